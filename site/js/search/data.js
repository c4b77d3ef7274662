/**
 * Loads the files of the index. Each is a script that passes its value to `coursebuildSearch.take`, as browsers load
 * scripts from disk, but no other data.
 */

/** A file could not be loaded. */
export class DataError extends Error {}

const arrivals = new WeakMap() // script element → its value

/** Called by the files while they run. */
export function take(kind, name, value) {
  arrivals.set(document.currentScript, value)
}

/** Load the value of a file. */
export function loadFile(address) {
  return new Promise((resolve, reject) => {
    const script = document.createElement('script')
    script.src = address
    script.onload = () => {
      script.remove()
      if (arrivals.has(script)) resolve(arrivals.get(script))
      else reject(new DataError(address))
    }
    script.onerror = () => {
      script.remove()
      reject(new DataError(address))
    }
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
