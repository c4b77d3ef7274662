/** The reader's recent queries, stored in this browser only. */

import { readChoice, writeChoice } from '../page/choices.js'

const MOST = 5
const key = (course) => `coursebuild.search.${course}`

/** The last queries, the newest first. */
export function recentQueries(course, storage) {
  try {
    const queries = JSON.parse(readChoice(key(course), storage))
    return Array.isArray(queries) ? queries.filter((query) => typeof query === 'string' && query !== '').slice(0, MOST) : []
  } catch {
    return []
  }
}

/** Store a query that led somewhere. */
export function noteQuery(course, query, storage) {
  const trimmed = query.trim().slice(0, 80)
  if (trimmed === '') return
  const rest = recentQueries(course, storage).filter((item) => item !== trimmed)
  writeChoice(key(course), JSON.stringify([trimmed, ...rest].slice(0, MOST)), storage)
}

export function forgetQueries(course, storage) {
  writeChoice(key(course), null, storage)
}
