/** Finding the object by which a learning platform speaks SCORM 1.2 (Run-Time Environment, section 3.2.4). */

const DEPTH = 50 // frames in frames; a chain that is longer is a circle, or not ours to search

/**
 * The platform's API: in a window above this one, else in the one that opened this one or above that; `null` where there is none.
 * A window of another host may be among them: it is passed over.
 * @param {Window} window
 */
export function findApi(window) {
  return above(window) ?? above(openerOf(window)) ?? openersOfTop(window)
}

function above(window) {
  for (let depth = 0; window && depth < DEPTH; depth++) {
    const api = apiOf(window)
    if (api) return api
    const parent = parentOf(window)
    if (parent === window) return null
    window = parent
  }
  return null
}

/** A platform may open a window with frames, of which this is one: the window at the top has the opener. */
function openersOfTop(window) {
  let top = window
  for (let depth = 0; depth < DEPTH; depth++) {
    const parent = parentOf(top)
    if (!parent || parent === top) break
    top = parent
  }
  return top === window ? null : above(openerOf(top))
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
