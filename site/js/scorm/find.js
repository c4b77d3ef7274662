/** Finds the API object of a learning platform (SCORM 1.2, Run-Time Environment, section 3.2.4). */

const DEPTH = 50 // the most nested frames that are searched

/**
 * The platform's API: in this window or a parent of it, else in the window that opened this one or a parent of that; else `null`.
 * Windows of other hosts are passed over.
 * @param {Window} window
 */
export function findApi(window) {
  return findAbove(window) ?? findAbove(openerOf(window)) ?? openersOfTop(window)
}

function findAbove(window) {
  for (let depth = 0; window && depth < DEPTH; depth++) {
    const api = apiOf(window)
    if (api) return api
    const parent = parentOf(window)
    if (parent === window) return null
    window = parent
  }
  return null
}

/** A platform may open a window of which this one is a frame: then the top window has the opener. */
function openersOfTop(window) {
  let top = window
  for (let depth = 0; depth < DEPTH; depth++) {
    const parent = parentOf(top)
    if (!parent || parent === top) break
    top = parent
  }
  return top === window ? null : findAbove(openerOf(top))
}

function apiOf(window) {
  try {
    return window.API ?? null
  } catch {
    return null
  }
}

function parentOf(window) {
  try {
    return window.parent ?? null
  } catch {
    return null
  }
}

function openerOf(window) {
  try {
    return window?.opener ?? null
  } catch {
    return null
  }
}
