/**
 * What lab code finds under `lib`: quantities that take more than an index, computed by MuJoCo.
 *
 * Nothing here changes the motion. `energy`, `momentum` and `angmom` need results that MuJoCo leaves in the data only on
 * demand; afterwards the data are as before, so that no readout changes another. Vectors are copies, in
 * SI units and the world frame.
 */

import { nameOf } from './names.js'

const DEGREES = 180 / Math.PI

/**
 * @param {import('./engine.js').Engine} engine
 * @param {Record<string, any>} model MjModel
 * @param {Record<string, any>} data the MjData that is read
 * @param {{force: Record<string, any>}} scratch a DoubleBuffer(6) of the owner
 * @param {() => number} random
 */
export function createLib(engine, model, data, scratch, random) {
  const { mj, k } = engine
  const ids = new Map()

  const id = (type, kind, name) => {
    if (typeof name === 'number') return name
    const key = `${type} ${name}`
    let index = ids.get(key)
    if (index === undefined) {
      index = mj.mj_name2id(model, type, String(name))
      if (index < 0) throw new Error(`the model has no ${kind} "${name}"`)
      ids.set(key, index)
    }
    return index
  }
  const row = (array, index, kind) => {
    if (!(index >= 0 && 3 * index < array.length)) throw new Error(`the model has no ${kind} number ${index}`)
    return array.slice(3 * index, 3 * index + 3)
  }

  return Object.freeze({
    /** J: {kinetic, potential, total}; potential: gravity and springs. */
    energy() {
      return withRestored(data, ['energy'], ['flg_energypos', 'flg_energyvel'], () => {
        mj.mj_energyPos(model, data)
        mj.mj_energyVel(model, data)
        const [potential, kinetic] = data.energy
        return { kinetic, potential, total: kinetic + potential }
      })
    },

    /** kg m/s, of everything. */
    momentum() {
      return subtree(() => data.subtree_linvel.slice(0, 3).map((v) => v * model.body_subtreemass[0]))
    },

    /** kg m²/s, of everything about its common centre of mass. */
    angmom() {
      return subtree(() => data.subtree_angmom.slice(0, 3))
    },

    sitePos: (name) => row(data.site_xpos, id(k.obj.SITE, 'site', name), 'site'),
    bodyPos: (name) => row(data.xpos, id(k.obj.BODY, 'body', name), 'body'),
    bodyId: (name) => id(k.obj.BODY, 'body', name),
    jointId: (name) => id(k.obj.JOINT, 'joint', name),

    /** The position of a joint: a number for a hinge (rad) or slide (m), four for a ball, seven for a free joint. */
    qpos(name) {
      const joint = id(k.obj.JOINT, 'joint', name)
      if (!(joint >= 0 && joint < model.njnt)) throw new Error(`the model has no joint number ${joint}`)
      const start = model.jnt_qposadr[joint]
      const size = { [k.joint.FREE]: 7, [k.joint.BALL]: 4 }[model.jnt_type[joint]] ?? 1
      return size === 1 ? data.qpos[start] : data.qpos.slice(start, start + size)
    },

    /** N: the sum of the normal forces of all contacts, or of those of one geom. */
    normalForce(geom) {
      const only = geom === undefined ? -1 : id(k.obj.GEOM, 'geom', geom)
      let sum = 0
      eachContact(data, (contact, i) => {
        if (only >= 0 && contact.geom1 !== only && contact.geom2 !== only) return
        mj.mj_contactForce(model, data, i, scratch.force)
        sum += scratch.force.GetView()[0]
      })
      return sum
    },

    /** The Euclidean length of a vector. */
    norm: (vector) => Math.sqrt(vector.reduce((sum, x) => sum + x * x, 0)),
    deg: (radians) => radians * DEGREES,
    rad: (degrees) => degrees / DEGREES,

    /** A number in [0, 1); the sequence starts again with every reset and depends on the lab's `seed`. */
    random,
  })

  function subtree(read) {
    return withRestored(data, ['subtree_linvel', 'subtree_angmom'], ['flg_subtreevel'], () => {
      mj.mj_subtreeVel(model, data)
      return read()
    })
  }
}

/** Call `compute`, then restore these arrays and flags of the data. */
function withRestored(data, arrays, flags, compute) {
  const arrayValues = arrays.map((name) => data[name].slice())
  const flagValues = flags.map((name) => data[name])
  const result = compute()
  arrays.forEach((name, i) => data[name].set(arrayValues[i]))
  flags.forEach((name, i) => (data[name] = flagValues[i]))
  return result
}

/** Call `visit(contact, i)` for each contact; the contact is a copy that lives for the call. */
export function eachContact(data, visit) {
  if (data.ncon === 0) return
  const vector = data.contact
  try {
    for (let i = 0; i < vector.size(); i++) {
      const contact = vector.get(i)
      try {
        visit(contact, i)
      } finally {
        contact.delete()
      }
    }
  } finally {
    vector.delete()
  }
}

/**
 * The contacts as plain objects, as `sim.contacts()` returns them: `geoms` are two ids (-1: not a geom, but part of a flex) and
 * `names` their names; `pos` (m) and `normal` (unit, from the first to the second) are in the world; `dist` is negative in
 * penetration (m); `force` is [normal, friction, friction, torsion, rolling, rolling] in the frame of the contact (N, N m).
 */
export function contactList(engine, model, data, scratch) {
  const { mj, k } = engine
  const list = []
  eachContact(data, (contact, i) => {
    mj.mj_contactForce(model, data, i, scratch.force)
    const geoms = [contact.geom1, contact.geom2]
    list.push({
      geoms,
      names: geoms.map((geom) => (geom < 0 ? '' : nameOf(engine, model, k.obj.GEOM, geom))),
      pos: Array.from(contact.pos),
      normal: Array.from(contact.frame.slice(0, 3)),
      dist: contact.dist,
      force: Array.from(scratch.force.GetView()),
    })
  })
  return list
}
