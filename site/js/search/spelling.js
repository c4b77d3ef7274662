/** Finds the words that a misspelt word may mean. */

import SearchableMap from 'minisearch/SearchableMap'

const MOST = 6

/** The number of mistakes that a word may have: none in a short one. */
export const tolerance = (word) => (word.length < 4 ? 0 : word.length < 8 ? 1 : 2)

/**
 * The number of letters that must be inserted, deleted, changed or swapped with their neighbour to turn one word into
 * another (optimal string alignment).
 */
export function distance(a, b) {
  let [beforeLast, last, row] = [[], [], Array.from({ length: b.length + 1 }, (_, index) => index)]
  for (let i = 1; i <= a.length; i++) {
    ;[beforeLast, last, row] = [last, row, [i]]
    for (let j = 1; j <= b.length; j++) {
      row[j] = Math.min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] === b[j - 1] ? 0 : 1))
      if (i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1]) row[j] = Math.min(row[j], beforeLast[j - 2] + 1)
    }
  }
  return row[b.length]
}

/** A radix tree of terms, in which thousands can be searched by similarity in a millisecond or two. */
export function lexicon(terms) {
  return SearchableMap.from([...terms].map((term) => [term, true]))
}

/**
 * Terms that a word may mean, the likeliest first: fewest mistakes, then the same first letter, then the same length.
 * The tree counts a swap as two mistakes, so it is searched with one more.
 * @param {SearchableMap[]} lexicons
 * @returns {Array<[term: string, mistakes: number]>}
 */
export function likelyTerms(word, lexicons) {
  const limit = tolerance(word)
  if (limit === 0) return []
  const mistakesByTerm = new Map()
  for (const terms of lexicons) {
    for (const term of terms.fuzzyGet(word, limit + 1).keys()) {
      const mistakes = distance(word, term)
      if (mistakes > 0 && mistakes <= limit) mistakesByTerm.set(term, mistakes)
    }
  }
  const order = ([term, mistakes]) => [mistakes, term[0] === word[0] ? 0 : 1, Math.abs(term.length - word.length), term]
  return [...mistakesByTerm].sort((a, b) => compare(order(a), order(b))).slice(0, MOST)
}

function compare(a, b) {
  for (let index = 0; index < a.length; index++) {
    if (a[index] !== b[index]) return a[index] < b[index] ? -1 : 1
  }
  return 0
}
