/**
 * Bodies that lie deep in each other: then a simulation is worthless, though MuJoCo does not warn.
 *
 *   deepContact(engine, model, data) → {names, depth} | null
 *
 * How deep is too deep only the author knows. In any model a contact is too deep if it exceeds half the smallest dimension of the
 * thinner geom, whose centre then lies inside the other one. (core/run/mujoco_watching.py applies the same rule to scripts.)
 */

import { eachContact } from '../core/lib.js'
import { nameOf } from '../core/names.js'

/** The deepest of the contacts that are too deep; `depth` in m, `names` for a message. */
export function deepContact(engine, model, data) {
  const { k } = engine
  let deepest = null
  let worst = 1
  eachContact(data, ({ geom1, geom2, dist, efc_address: row }) => {
    if (row < 0 || geom1 < 0 || geom2 < 0 || !(dist < 0)) return
    const size = Math.min(halfSize(k, model, geom1), halfSize(k, model, geom2))
    if (!(-dist / size > worst)) return
    worst = -dist / size
    deepest = { geoms: [geom1, geom2], depth: -dist }
  })
  if (deepest === null) return null
  const name = (geom) => nameOf(engine, model, k.obj.GEOM, geom)
  return { names: deepest.geoms.map((geom) => (name(geom) ? `\`${name(geom)}\`` : `geom ${geom}`)), depth: deepest.depth }
}

/** Half the smallest dimension (m); planes and height fields have none. */
function halfSize(k, model, geom) {
  const type = model.geom_type[geom]
  if (type === k.geom.PLANE || type === k.geom.HFIELD) return Infinity
  const start = 6 * geom
  return Math.min(...model.geom_aabb.subarray(start + 3, start + 6))
}
