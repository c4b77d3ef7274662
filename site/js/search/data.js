/**
 * Loads the files of the index. Each is a script that passes its value to `coursebuildSearch.take`, as browsers load
 * scripts from disk, but no other data.
 */

import { loadScript } from '../page/scripts.js'

const arrivals = new WeakMap() // script element → its value

/** Called by the files while they run. */
export function take(kind, name, value) {
  arrivals.set(document.currentScript, value)
}

export async function loadFile(address) {
  const script = await loadScript(address)
  script.remove()
  if (!arrivals.has(script)) throw new Error(address)
  return arrivals.get(script)
}
