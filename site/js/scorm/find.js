/** Finds the API object of a learning platform (SCORM 1.2, Run-Time Environment, section 3.2.4). */

const DEPTH = 50 // the most nested frames that are searched

/**
 * The platform's API: in this window or a parent of it, else in the window that opened this one, or of which this one is a frame, or in a
 * parent of that; else `null`. Windows of other hosts are passed over.
 * @param {Window} window
 */
export function findApi(window) {
  return findAbove(window) ?? findAbove(read(window, 'opener')) ?? findAbove(read(read(window, 'top'), 'opener'))
}

function findAbove(window) {
  for (let depth = 0; window && depth < DEPTH; depth++) {
    const api = read(window, 'API')
    if (api) return api
    const parent = read(window, 'parent')
    if (parent === window) return null
    window = parent
  }
  return null
}

/** A property of a window; `null` where another host forbids to read it. */
function read(window, name) {
  try {
    return window?.[name] ?? null
  } catch {
    return null
  }
}
