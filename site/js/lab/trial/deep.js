/**
 * Bodies that lie deep in each other: a simulation is lost in this way without a warning of MuJoCo's.
 *
 *   deepContact(engine, model, data) → {names, depth} | null
 *
 * How deep is too deep only the author knows. What can be said of any model: a contact deeper than half of what the thinner
 * of the two geoms measures in its shortest direction, so that its middle lies in the other one.
 * (core/run/mujoco_watching.py says the same of scripts.)
 */

import { eachContact } from '../core/lib.js'
import { nameOf } from '../core/names.js'

/** The deepest contact that is too deep; `depth` in m, `names` as words. */
export function deepContact(engine, model, data) {
  const { k } = engine
  let found = null
  let worst = 1
  eachContact(data, ({ geom1, geom2, dist, efc_address: row }) => {
    if (row < 0 || geom1 < 0 || geom2 < 0 || !(dist < 0)) return
    const size = Math.min(halfSize(k, model, geom1), halfSize(k, model, geom2))
    if (!(-dist / size > worst)) return
    worst = -dist / size
    found = { geoms: [geom1, geom2], depth: -dist }
  })
  if (found === null) return null
  const name = (geom) => nameOf(engine, model, k.obj.GEOM, geom)
  return { names: found.geoms.map((geom) => (name(geom) ? `\`${name(geom)}\`` : `geom ${geom}`)), depth: found.depth }
}

/** m; planes and height fields have no middle to be deep in. */
function halfSize(k, model, geom) {
  const type = model.geom_type[geom]
  if (type === k.geom.PLANE || type === k.geom.HFIELD) return Infinity
  const at = 6 * geom
  return Math.min(...model.geom_aabb.subarray(at + 3, at + 6))
}
