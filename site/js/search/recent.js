/** What the reader searched for before, in this browser only; without storage there is nothing. */

const MOST = 5
const key = (course) => `coursebuild.search.${course}`

/** The last queries, the newest first. */
export function recentQueries(course, storage = localStorageOrNothing()) {
  try {
    const found = JSON.parse(storage.getItem(key(course)))
    return Array.isArray(found) ? found.filter((query) => typeof query === 'string' && query !== '').slice(0, MOST) : []
  } catch {
    return []
  }
}

/** Note a query that led somewhere. */
export function noteQuery(course, query, storage = localStorageOrNothing()) {
  const said = query.trim().slice(0, 80)
  if (said === '') return
  const others = recentQueries(course, storage).filter((other) => other !== said)
  try {
    storage.setItem(key(course), JSON.stringify([said, ...others].slice(0, MOST)))
  } catch {
    // Storage is closed or full: nothing is remembered.
  }
}

/** Forget them. */
export function forgetQueries(course, storage = localStorageOrNothing()) {
  try {
    storage.removeItem(key(course))
  } catch {
    // Then nothing was remembered.
  }
}

function localStorageOrNothing() {
  try {
    return globalThis.localStorage ?? null
  } catch {
    return null
  }
}
