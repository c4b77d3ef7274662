/** Loads classic scripts: from disk browsers load neither modules nor data. */

import { h } from '../lab/page/dom.js'

/** Load a script; the promise has its element, and is rejected if it cannot be loaded. @returns {Promise<HTMLScriptElement>} */
export function loadScript(src) {
  return new Promise((resolve, reject) => {
    const script = h('script', { src, onload: () => resolve(script), onerror: () => reject(new Error(src)) })
    document.head.append(script)
  })
}

/** A function that caches its last results, promises, by its argument; rejected ones are dropped. */
export function memoize(make, limit) {
  const cache = new Map()
  return (key) => {
    let promise = cache.get(key)
    cache.delete(key)
    if (promise === undefined) {
      promise = make(key)
      promise.catch(() => cache.get(key) === promise && cache.delete(key))
    }
    cache.set(key, promise)
    if (cache.size > limit) cache.delete(cache.keys().next().value)
    return promise
  }
}

/** Load a script, unless that was done before; a failed load is tried again. */
export const loadOnce = memoize(loadScript, Infinity)
