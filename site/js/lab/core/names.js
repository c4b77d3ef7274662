/** Finds what a lab's data name in its model. */

/** The number of a keyframe, by name or number; -1 for none. */
export function keyframe(engine, model, key) {
  if (key === null || key === undefined) return -1
  const index = typeof key === 'number' ? key : engine.mj.mj_name2id(model, engine.k.obj.KEY, key)
  if (!(Number.isInteger(index) && index >= 0 && index < model.nkey)) {
    throw new RangeError(`the model has no keyframe ${JSON.stringify(key)}`)
  }
  return index
}

/** The id of a site; -1 for none. */
export function siteOf(engine, model, name) {
  if (!name) return -1
  const site = engine.mj.mj_name2id(model, engine.k.obj.SITE, name)
  if (site < 0) throw new RangeError(`the model has no site "${name}"`)
  return site
}

/** The name of an object, or ''. For an object without a name the bindings return whatever text lies at the null address. */
export function nameOf(engine, model, type, i) {
  const name = engine.mj.mj_id2name(model, type, i) ?? ''
  return engine.mj.mj_name2id(model, type, name) === i ? name : ''
}
