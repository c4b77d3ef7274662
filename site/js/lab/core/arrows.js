/**
 * What a text about a motion speaks of and nobody sees: momentum, angular momentum, the axis of rotation.
 *
 *   momenta(model, data) → { momentum, angularMomentum, axis }    of each a list of { at, vector }, in the world
 *
 * All is read from data that is up to date and nothing is written, so that looking changes no bit of the motion.
 */

const PART = 0.3 // of the picture's height is an arrow of the usual length
const THICK = 0.009 // radius of an arrow, in heights of the picture
const AXIS = 0.42 // how far an axis reaches to either side, in the same
const NOTHING = 1e-9
export const ARROW = 100 // mjtGeom
const CYLINDER = 5
export const IN_FRONT = -2 // in the place of a data id: nothing covers it, though it begins inside a body
const INNER = 0.84 // of a double arrow's length is its second head
const COLOURS = { momentum: [0, 0.45, 0.7, 1], angularMomentum: [0.84, 0.37, 0, 1], axis: [0.62, 0.34, 0.6, 1] }

const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i])
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
const norm = (a) => Math.hypot(...a)
const three = (array, i) => Array.from(array.subarray(3 * i, 3 * i + 3))

/** Momentum at the centre of mass of each body; angular momentum and axis of each tree of bodies. */
export function momenta(engine, model, data) {
  const trees = new Map()
  for (let i = 1; i < model.nbody; i++) {
    const tree = model.body_treeid[i]
    if (tree < 0 || !(model.body_mass[i] > 0)) continue
    if (!trees.has(tree)) trees.set(tree, [])
    trees.get(tree).push(moving(model, data, i))
  }
  const found = { momentum: [], angularMomentum: [], axis: [] }
  for (const bodies of trees.values()) {
    const at = pivot(engine, model, data, bodies[0].id) ?? middle(bodies)
    let least = 0
    let turning = [0, 0, 0]
    for (const { mass, place, velocity, spin } of bodies) {
      found.momentum.push({ at: place, vector: velocity.map((v) => mass * v) })
      turning = add(add(turning, spin), cross(add(place, at, -1), velocity), mass)
      least += NOTHING * mass * norm(velocity) * model.stat.extent
    }
    found.angularMomentum.push({ at, vector: norm(turning) > least ? turning : [0, 0, 0] })
    found.axis.push({ at, vector: bodies[0].rate })
  }
  return found
}

/** A body with mass: where it is, how it moves, and its angular momentum about its own centre. */
function moving(model, data, id) {
  const rate = three(data.cvel, 2 * id)
  const place = three(data.xipos, id)
  const offset = add(place, three(data.subtree_com, model.body_rootid[id]), -1)
  const velocity = add(three(data.cvel, 2 * id + 1), cross(rate, offset))
  const R = data.ximat.subarray(9 * id, 9 * id + 9)
  const own = three(model.body_inertia, id).map((I, j) => I * (R[j] * rate[0] + R[3 + j] * rate[1] + R[6 + j] * rate[2]))
  const spin = [0, 1, 2].map((i) => R[3 * i] * own[0] + R[3 * i + 1] * own[1] + R[3 * i + 2] * own[2])
  return { id, mass: model.body_mass[id], place, velocity, rate, spin }
}

/** The point about which a body turns, where hinges or a ball joint hold it; else null. */
function pivot({ k }, model, data, body) {
  const first = model.body_jntadr[body]
  const types = model.jnt_type.subarray(first, first + model.body_jntnum[body])
  const turns = types.every((type) => type === k.joint.HINGE || type === k.joint.BALL)
  return turns && types.length > 0 ? three(data.xanchor, first) : null
}

function middle(bodies) {
  const mass = bodies.reduce((sum, body) => sum + body.mass, 0)
  return bodies.reduce((sum, body) => add(sum, body.place, body.mass / mass), [0, 0, 0])
}

/** How long arrows have to be, found from what is seen of a motion: the middle one of each kind is as long as suits the picture. */
export class ArrowScales {
  constructor() {
    this.seen = { momentum: [], angularMomentum: [], axis: [], forces: [] }
  }

  /** Take in a moment. */
  see(lab) {
    const { model, data, sim } = lab.sync()
    for (const [name, list] of Object.entries(momenta(lab.engine, model, data))) this.note(name, list.map(({ vector }) => vector))
    if (data.ncon > 0) this.note('forces', sim.contacts().map(({ force }) => force.slice(0, 3)))
  }

  note(name, vectors) {
    const most = Math.max(...vectors.map(norm))
    if (most > 0 && Number.isFinite(most)) this.seen[name].push(most)
  }

  /** For a picture of this height (m): `width` of an arrow, and metres for each unit of what the motion has. */
  fit(height) {
    const scales = { width: THICK * height }
    for (const [name, lengths] of Object.entries(this.seen)) {
      if (lengths.length === 0) continue
      lengths.sort((a, b) => a - b)
      scales[name] = (PART * height) / lengths[lengths.length >> 1]
    }
    if (scales.axis) scales.axis = AXIS * height
    return scales
  }
}

/** Rows of a frame (see `frame.js`) that show what is switched on, as long as `scales` say. */
export function arrowRows(found, shown, scales) {
  const rows = []
  for (const name of shown) {
    for (const { at, vector } of found[name]) {
      const length = norm(vector)
      if (!(length > 0) || !scales[name]) continue
      const z = vector.map((x) => x / length)
      if (name === 'axis') rows.push(row([CYLINDER, -1], at, z, [0.4 * scales.width, 0.4 * scales.width, scales.axis], COLOURS.axis))
      else {
        // From its place an arrow reaches half of its third size.
        const reach = 2 * length * scales[name]
        const heads = name === 'momentum' ? [1] : [1, INNER]
        for (const part of heads) rows.push(row([ARROW, IN_FRONT], at, z, [scales.width, scales.width, part * reach], COLOURS[name]))
      }
    }
  }
  return rows
}

function row(kind, at, z, size, colour) {
  const aside = Math.abs(z[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0]
  const y = cross(z, aside)
  const length = norm(y)
  const [a, b] = [cross(y, z), y].map((axis) => axis.map((x) => x / length))
  return [...kind, 0, -1, ...size, ...at, ...[0, 1, 2].flatMap((i) => [a[i], b[i], z[i]]), ...colour, 0.3]
}
