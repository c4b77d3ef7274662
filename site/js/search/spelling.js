/** Words that a misspelt word may mean. */

import SearchableMap from 'minisearch/SearchableMap'

const MOST = 6

/** How many mistakes a word may have: none in a short one. */
export const tolerance = (word) => (word.length < 4 ? 0 : word.length < 8 ? 1 : 2)

/**
 * How many letters must be put in, left out, changed or swapped with their neighbour to make one word of another
 * (optimal string alignment).
 */
export function distance(a, b) {
  let [before, last, row] = [[], [], Array.from({ length: b.length + 1 }, (_, at) => at)]
  for (let i = 1; i <= a.length; i++) {
    ;[before, last, row] = [last, row, [i]]
    for (let j = 1; j <= b.length; j++) {
      row[j] = Math.min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] === b[j - 1] ? 0 : 1))
      if (i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1]) row[j] = Math.min(row[j], before[j - 2] + 1)
    }
  }
  return row[b.length]
}

/** Terms to be looked up by likeness: a radix tree, so that a look at thousands takes a millisecond or two. */
export function lexicon(terms) {
  return SearchableMap.from([...terms].map((term) => [term, true]))
}

/**
 * Terms that a word may mean, the likeliest first: fewest mistakes, then the same first letter, then the same length.
 * The tree counts a swap as two mistakes, so that it is asked for one more.
 * @param {SearchableMap[]} lexicons
 * @returns {Array<[term: string, mistakes: number]>}
 */
export function likely(word, lexicons) {
  const most = tolerance(word)
  if (most === 0) return []
  const found = new Map()
  for (const terms of lexicons) {
    for (const term of terms.fuzzyGet(word, most + 1).keys()) {
      const mistakes = distance(word, term)
      if (mistakes > 0 && mistakes <= most) found.set(term, mistakes)
    }
  }
  const order = ([term, mistakes]) => [mistakes, term[0] === word[0] ? 0 : 1, Math.abs(term.length - word.length), term]
  return [...found].sort((a, b) => compare(order(a), order(b))).slice(0, MOST)
}

function compare(a, b) {
  for (let at = 0; at < a.length; at++) {
    if (a[at] !== b[at]) return a[at] < b[at] ? -1 : 1
  }
  return 0
}
