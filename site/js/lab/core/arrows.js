/**
 * Arrows for quantities of a motion that cannot be seen: momentum, angular momentum, the axis of rotation.
 *
 *   momenta(engine, model, data) → { momentum, angularMomentum, axis }    a list of { at, vector } each, in the world
 *
 * The data must be up to date and are only read, so that drawing arrows changes no bit of the motion.
 */

import { cross, toLocal, toWorld } from './vectors.js'

const PART = 0.3 // length of a typical arrow, in heights of the picture
const THICK = 0.009 // radius of an arrow, in heights of the picture
const AXIS = 0.42 // how far an axis reaches to either side, in the same
const NOTHING = 1e-9 // relative: a smaller angular momentum counts as zero
export const THICKER = 2 // times, at which a reader points
export const ARROW = 100 // mjtGeom
const CYLINDER = 5
export const IN_FRONT = -2 // in place of a data id: drawn over everything, as an arrow begins inside a body
const INNER = 0.84 // place of a double arrow's second head, in lengths of the arrow
const COLOURS = { momentum: [0, 0.45, 0.7, 1], angularMomentum: [0.84, 0.37, 0, 1], axis: [0.62, 0.34, 0.6, 1] }

const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i])
const norm = (a) => Math.hypot(...a)
const vectorAt = (array, i) => Array.from(array.subarray(3 * i, 3 * i + 3))

/** Momentum at the centre of mass of each body; angular momentum and axis of each tree of bodies. */
export function momenta(engine, model, data) {
  const trees = new Map()
  for (let i = 1; i < model.nbody; i++) {
    const tree = model.body_treeid[i]
    if (tree < 0 || !(model.body_mass[i] > 0)) continue
    if (!trees.has(tree)) trees.set(tree, [])
    trees.get(tree).push(motionOf(model, data, i))
  }
  const quantities = { momentum: [], angularMomentum: [], axis: [] }
  for (const bodies of trees.values()) {
    const point = pivot(engine, model, data, bodies[0].id) ?? centreOfMass(bodies)
    let threshold = 0
    let total = [0, 0, 0]
    for (const { mass, place, velocity, spin } of bodies) {
      quantities.momentum.push({ at: place, vector: velocity.map((v) => mass * v) })
      total = add(add(total, spin), cross(add(place, point, -1), velocity), mass)
      threshold += NOTHING * mass * norm(velocity) * model.stat.extent
    }
    quantities.angularMomentum.push({ at: point, vector: norm(total) > threshold ? total : [0, 0, 0] })
    quantities.axis.push({ at: point, vector: bodies[0].rate })
  }
  return quantities
}

/** A body with mass: where it is, how it moves, and its angular momentum about its own centre. */
function motionOf(model, data, id) {
  const rate = vectorAt(data.cvel, 2 * id)
  const place = vectorAt(data.xipos, id)
  const offset = add(place, vectorAt(data.subtree_com, model.body_rootid[id]), -1)
  const velocity = add(vectorAt(data.cvel, 2 * id + 1), cross(rate, offset))
  const R = data.ximat.subarray(9 * id, 9 * id + 9)
  const local = toLocal(R, rate)
  const spin = toWorld(R, vectorAt(model.body_inertia, id).map((I, j) => I * local[j]))
  return { id, mass: model.body_mass[id], place, velocity, rate, spin }
}

/** The point about which a body turns, where hinges or a ball joint hold it; else null. */
function pivot({ k }, model, data, body) {
  const firstJoint = model.body_jntadr[body]
  const types = model.jnt_type.subarray(firstJoint, firstJoint + model.body_jntnum[body])
  const turns = types.every((type) => type === k.joint.HINGE || type === k.joint.BALL)
  return turns && types.length > 0 ? vectorAt(data.xanchor, firstJoint) : null
}

function centreOfMass(bodies) {
  const mass = bodies.reduce((sum, body) => sum + body.mass, 0)
  return bodies.reduce((sum, body) => add(sum, body.place, body.mass / mass), [0, 0, 0])
}

/** The scales of arrows: such that the median arrow of each kind, over all observed moments, has a length that suits the picture. */
export class ArrowScales {
  constructor() {
    this.lengths = { momentum: [], angularMomentum: [], axis: [], forces: [] }
  }

  /** Collect the lengths of this moment. */
  observe(lab) {
    const { model, data, sim } = lab.sync()
    for (const [name, list] of Object.entries(momenta(lab.engine, model, data))) this.note(name, list.map(({ vector }) => vector))
    if (data.ncon > 0) this.note('forces', sim.contacts().map(({ force }) => force.slice(0, 3)))
  }

  note(name, vectors) {
    const longest = Math.max(...vectors.map(norm))
    if (longest > 0 && Number.isFinite(longest)) this.lengths[name].push(longest)
  }

  /** The scales for a picture of this height (m): `width` of an arrow, and for each kind the metres per unit. */
  fit(height) {
    const scales = { width: THICK * height }
    for (const [name, lengths] of Object.entries(this.lengths)) {
      if (lengths.length === 0) continue
      lengths.sort((a, b) => a - b)
      scales[name] = (PART * height) / lengths[lengths.length >> 1]
    }
    if (scales.axis) scales.axis = AXIS * height
    return scales
  }
}

/** The rows of a frame (see `frame.js`) that draw the quantities called `names`, with lengths by `scales`; the `pointed` one is thicker. */
export function arrowRows(quantities, names, scales, pointed = null) {
  const rows = []
  for (const name of names) {
    const width = scales.width * (name === pointed ? THICKER : 1)
    for (const { at: point, vector } of quantities[name]) {
      const length = norm(vector)
      if (!(length > 0) || !scales[name]) continue
      const z = vector.map((x) => x / length)
      if (name === 'axis') rows.push(row([CYLINDER, -1], point, z, [0.4 * width, 0.4 * width, scales.axis], COLOURS.axis))
      else {
        // MuJoCo draws an arrow half as long as its third size.
        const reach = 2 * length * scales[name]
        const heads = name === 'momentum' ? [1] : [1, INNER]
        for (const part of heads) rows.push(row([ARROW, IN_FRONT], point, z, [width, width, part * reach], COLOURS[name]))
      }
    }
  }
  return rows
}

function row(kind, point, z, size, colour) {
  const aside = Math.abs(z[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0]
  const y = cross(z, aside)
  const length = norm(y)
  const [a, b] = [cross(y, z), y].map((axis) => axis.map((x) => x / length))
  return [...kind, 0, -1, ...size, ...point, ...[0, 1, 2].flatMap((i) => [a[i], b[i], z[i]]), ...colour, 0.3]
}
