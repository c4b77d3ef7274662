/** The reader's recent queries, stored in this browser only. */

const MOST = 5
const key = (course) => `coursebuild.search.${course}`

/** The last queries, the newest first. */
export function recentQueries(course, storage = openStorage()) {
  try {
    const queries = JSON.parse(storage.getItem(key(course)))
    return Array.isArray(queries) ? queries.filter((query) => typeof query === 'string' && query !== '').slice(0, MOST) : []
  } catch {
    return []
  }
}

/** Store a query that led somewhere. */
export function noteQuery(course, query, storage = openStorage()) {
  const trimmed = query.trim().slice(0, 80)
  if (trimmed === '') return
  const rest = recentQueries(course, storage).filter((item) => item !== trimmed)
  try {
    storage.setItem(key(course), JSON.stringify([trimmed, ...rest].slice(0, MOST)))
  } catch {
    // Storage is blocked or full: nothing is stored.
  }
}

/** Forget all queries. */
export function forgetQueries(course, storage = openStorage()) {
  try {
    storage.removeItem(key(course))
  } catch {
    // Storage is blocked: nothing was stored.
  }
}

function openStorage() {
  try {
    return globalThis.localStorage ?? null
  } catch {
    return null
  }
}
