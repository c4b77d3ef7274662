/**
 * Which pages a query means: by the index alone, before the text of any page is loaded.
 *
 * Entry point: `findPages(query, source)`.
 *
 * 1. Each word is looked up as it is, as the beginning of others, and, where it is a name, by its parts.
 * 2. A word that is nowhere, or a query that finds next to nothing, is looked up in the spelling that is most like it.
 * 3. A page counts for each word once, by the best of what it has of it: exact before begun before misspelt, and title
 *    before heading before text before code. A word counts the more the fewer pages have it. A page that lacks words
 *    falls behind.
 */

import { readPages, shardOf, spellingOf } from './index.js'
import { likely, tolerance } from './spelling.js'
import { BEGINNING, isFuzzy, isRow, termsOf, wordsOf } from './words.js'

const EXACT = 1
const BEGUN = 0.55
const PARTS = 0.5
const MISSPELT = [0, 0.45, 0.3] // by mistakes
const FIELDS = [0.7, 1, 2.4, 5] // code, text, heading, title
const TITLE = 3 << 2
const OFTEN = 0.22 // for each step of how often
const NAMED = 2.5 // a page that is called so
const KINDS = { lesson: 1, level: 0.8, stub: 0.5 } // lessons come before documents of the tool
const OTHER = 0.7
const FEW = 1 // pages with all words; below, other spellings are looked at as well
const MOST_BEGUN = 64 // terms that begin with a word

/**
 * @param {string} query
 * @param {{ listing: object, shard: (n: number) => Promise<Map<string, string>>, spelling: (n: number) => Promise<object> }} source
 * @returns {Promise<{ pages: { page: number, score: number, words: number }[], words: object[] }>} pages, the best first;
 *   of each word its terms by how well they fit, and whether it was taken for another (`instead`)
 */
export async function findPages(query, source) {
  const words = (await Promise.all(distinct(wordsOf(plainQuery(query))).map((terms) => lookUpAll(terms, source)))).flat()
  const lost = words.filter((word) => word.terms.size === 0)
  await Promise.all(lost.map((word) => respell(word, source, true)))
  let pages = ranked(words, source.listing)
  if (pages.filter((page) => page.words === words.length).length < FEW) {
    await Promise.all(words.filter((word) => !lost.includes(word)).map((word) => respell(word, source, false)))
    pages = ranked(words, source.listing)
  }
  return { pages, words }
}

/** A query without the TeX that says how a formula looks: an index is written as in plain text. */
export const plainQuery = (query) =>
  query
    .replace(/\\(?:math[a-z]+|text[a-z]*|boldsymbol|bm|left|right|operatorname)(?![a-z])/g, ' ')
    .replace(/([A-Za-z0-9])_\{(\w+)\}/g, '$1_$2')

/** Each word once; more than a dozen are no query. */
function distinct(words) {
  return [...new Map(words.map((terms) => [terms[0], terms])).values()].slice(0, 12)
}

/** A word, or instead of a name with dots that is nowhere its parts. */
async function lookUpAll(terms, source) {
  const word = await lookUp(terms, source)
  const parts = terms[0].includes('.') && word.terms.size === 0 ? wordsOf(terms[0].replaceAll('.', ' ')) : []
  return parts.length > 0 ? Promise.all(parts.map((part) => lookUp(part, source))) : [word]
}

/** A word with the pages that have it: `pages` by number, each with the best fit and weight. */
async function lookUp(terms, source) {
  const [whole, ...parts] = terms
  const word = { whole, terms: new Map(), pages: new Map(), instead: null }
  const lines = await source.shard(shardOf(source.listing, whole))
  if (lines.has(whole)) add(word, whole, lines.get(whole), EXACT)
  if ([...whole].length >= BEGINNING || isRow(whole)) {
    const begun = [...lines.keys()].filter((term) => term !== whole && term.startsWith(whole))
    for (const term of begun.slice(0, MOST_BEGUN)) add(word, term, lines.get(term), BEGUN)
  } else {
    byTitle(word, source.listing)
  }
  if (word.terms.size === 0 && parts.length > 0) await byParts(word, parts, source)
  return word
}

const titles = new WeakMap() // list of pages → terms of each title

/** Of a short word, which may begin terms in any file, only titles are known. */
function byTitle(word, listing) {
  if (!titles.has(listing)) {
    titles.set(
      listing,
      listing.pages.map(([, , title]) => termsOf(title)),
    )
  }
  titles.get(listing).forEach((terms, page) => {
    for (const term of terms) {
      if (term === word.whole || !term.startsWith(word.whole)) continue
      word.terms.set(term, BEGUN)
      best(word.pages, page, BEGUN, TITLE)
    }
  })
}

/** Pages that have every part of a name. */
async function byParts(word, parts, source) {
  const lines = await Promise.all(parts.map(async (part) => (await source.shard(shardOf(source.listing, part))).get(part)))
  if (lines.includes(undefined)) return
  const found = lines.map((line) => new Map(readPages(line)))
  const [first, ...others] = found
  for (const [page, weight] of first) {
    if (others.every((pages) => pages.has(page))) best(word.pages, page, PARTS, weight)
  }
  if (word.pages.size > 0) parts.forEach((part) => word.terms.set(part, PARTS))
}

/**
 * Look a word up in other spellings. Where the first letter is wrong or missing the right one is unknown, and for a word
 * that is nowhere all spellings are looked at.
 */
async function respell(word, source, thorough) {
  if (tolerance(word.whole) === 0 || !isFuzzy(word.whole)) return
  const { listing } = source
  const near = new Set([...word.whole].slice(0, 2).map((letter) => spellingOf(listing, letter)))
  let found = likely(word.whole, await Promise.all([...near].map(source.spelling)))
  if (thorough && found.length === 0) {
    const all = Array.from({ length: listing.words }, (_, at) => listing.terms + at)
    found = likely(word.whole, await Promise.all(all.map(source.spelling)))
  }
  const shards = await Promise.all(found.map(([term]) => source.shard(shardOf(listing, term))))
  found.forEach(([term, mistakes], at) => {
    if (shards[at].has(term)) add(word, term, shards[at].get(term), MISSPELT[mistakes])
  })
  if (thorough && found.length > 0) word.instead = found[0][0]
}

function add(word, term, line, fit) {
  word.terms.set(term, fit)
  for (const [page, weight] of readPages(line)) best(word.pages, page, fit, weight)
}

function best(pages, page, fit, weight) {
  const value = fit * FIELDS[weight >> 2] * (1 + OFTEN * (weight & 3))
  if (value > (pages.get(page) ?? 0)) pages.set(page, value)
}

/** Pages by score, and among equals in the order of the course. */
function ranked(words, listing) {
  const all = listing.pages.length
  const rarity = words.map(({ pages }) => Math.log(1 + (all - pages.size + 0.5) / (pages.size + 0.5)))
  const whole = rarity.reduce((sum, value) => sum + value, 0)
  const found = new Map()
  words.forEach(({ pages }, at) => {
    for (const [page, value] of pages) {
      const sum = found.get(page) ?? { page, score: 0, share: 0, words: 0 }
      sum.score += value * rarity[at]
      sum.share += rarity[at] / whole
      sum.words += 1
      found.set(page, sum)
    }
  })
  const called = new Set(words.map(({ whole }) => whole))
  for (const sum of found.values()) {
    const [, kind, , name] = listing.pages[sum.page]
    sum.score *= sum.share ** 2 * (KINDS[listing.kinds[kind]] ?? OTHER)
    if (name && called.has(name.toLowerCase())) sum.score *= NAMED
  }
  return [...found.values()].sort((a, b) => b.score - a.score || a.page - b.page)
}
