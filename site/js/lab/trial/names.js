/**
 * Looks up the names in a lab's code: which of them do not exist, and how long the arrays are.
 *
 *   lookUp(engine, bytes, [['data', 'qpos'], ['lib', 'enrgy']]) → [{length: 1}, {at: 1, names: ['energy', …]}]
 *
 * `at` is the first part of a path that does not exist, `names` are those that could stand there.
 */

import { environment } from '../core/environment.js'

const GLOBALS = ['Math', 'Number', 'Array', 'Object', 'String', 'JSON']
const OF_BINDINGS = /^[_$]|^(constructor|clone|delete|deleteLater|isAliasOf|isDeleted|toString)$/

export function lookUp(engine, bytes, paths) {
  const handles = engine.load(bytes)
  const { model, data } = handles
  try {
    const env = environment(/** @type {any} */ ({ engine, model, ctx: {}, scratch: {} }), data, true)
    return paths.map((path) => resolve(env, path))
  } finally {
    handles.dispose()
  }
}

/** @param {Record<string, any>} env @param {string[]} path */
function resolve(env, path) {
  const [root] = path
  if (!(root in env || root in globalThis)) return { at: 0, names: [...Object.keys(env), ...GLOBALS] }
  if (!(root in env) && root !== 'Math') return {} // changes to other globals are found by guard.js
  let owner = env[root] ?? Math
  for (let depth = 1; depth < path.length; depth++) {
    if (owner === null || !['object', 'function'].includes(typeof owner)) return {}
    if (!(path[depth] in owner)) return { at: depth, names: namesOf(owner) }
    owner = owner[path[depth]]
  }
  return ArrayBuffer.isView(owner) ? { length: /** @type {any} */ (owner).length } : {}
}

function namesOf(owner) {
  const names = []
  for (let o = owner; o !== null && o !== Object.prototype; o = Object.getPrototypeOf(o)) names.push(...Object.getOwnPropertyNames(o))
  return names.filter((name) => !OF_BINDINGS.test(name))
}
