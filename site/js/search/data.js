/**
 * The files of the index. Each is a script that hands its value to `coursebuildSearch.take`: browsers load scripts from
 * a disk, but no other data, and so there is one way for both.
 */

/** A file that did not come. */
export class DataError extends Error {}

const arrivals = new WeakMap() // script element → what it handed over

/** What the files call, while they run. */
export function take(kind, name, value) {
  arrivals.set(document.currentScript, value)
}

/** The value of a file. */
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

/** A function whose last results are remembered by its argument, as promises; those that fail are forgotten. */
export function remembered(make, most) {
  const known = new Map()
  return (key) => {
    let found = known.get(key)
    known.delete(key)
    if (found === undefined) {
      found = make(key)
      found.catch(() => known.get(key) === found && known.delete(key))
    }
    known.set(key, found)
    if (known.size > most) known.delete(known.keys().next().value)
    return found
  }
}
