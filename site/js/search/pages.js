/**
 * Finds the pages for a query by the index alone, before the text of any page is loaded.
 *
 * Entry point: `findPages(query, source)`.
 *
 * 1. Each word is looked up as it is, as the beginning of longer terms, and, if it is a name, by its parts.
 * 2. An unknown word, or all words of a query that finds next to nothing, is looked up in the most similar spelling.
 * 3. A page scores once for each word, by its best match: exact before prefix before misspelt, and title before heading
 *    before text before code. A word counts the more the fewer pages have it. A page that lacks words gets less.
 */

import { readPages, shardOf, spellingOf } from './index.js'
import { likelyTerms, tolerance } from './spelling.js'
import { BEGINNING, isFuzzy, isRow, termsOf, wordsOf } from './words.js'

const EXACT = 1
const PREFIX = 0.55
const HINT = 0.15 // the beginning of a title, by a short word that is found as it is
const PARTS = 0.5
const MISSPELT = [0, 0.45, 0.3] // by mistakes
const FIELDS = [0.7, 1, 2.4, 5] // code, text, heading, title
const TITLE = 3 << 2
const OFTEN = 0.22 // for each step of the frequency
const NAMED = 2.5 // a page whose name is in the query
const KINDS = { lesson: 1, level: 0.8 } // lessons come before other pages

/** The order of results: what can be read comes before lessons that are planned only, then by score. */
export const byRank = (a, b) => Number(a.kind === 'stub') - Number(b.kind === 'stub') || b.score - a.score
const OTHER = 0.7
const FEW = 1 // pages with all words; if there are fewer, other spellings are tried as well
const MOST_BEGUN = 64 // terms that begin with a word

/**
 * @param {string} query
 * @param {{ listing: Record<string, any>, shard: (n: number) => Promise<Map<string, string>>, spelling: (n: number) => Promise<Record<string, any>> }} source
 * @returns {Promise<{ pages: { page: number, kind: string, score: number, words: number }[], words: Record<string, any>[] }>} pages, the best first;
 *   of each word its terms by how well they fit, and the spelling that it was taken for (`instead`)
 */
export async function findPages(query, source) {
  const words = (await Promise.all(distinct(wordsOf(plainQuery(query))).map((terms) => lookUpAll(terms, source)))).flat()
  const lost = words.filter((word) => word.terms.size === 0)
  await Promise.all(lost.map((word) => respell(word, source, true)))
  let pages = rankPages(words, source.listing)
  if (pages.filter((page) => page.words === words.length).length < FEW) {
    await Promise.all(words.filter((word) => !lost.includes(word)).map((word) => respell(word, source, false)))
    pages = rankPages(words, source.listing)
  }
  return { pages, words }
}

/** A query without the TeX for the look of a formula, and with subscripts as in plain text. */
const plainQuery = (query) =>
  query
    .replace(/\\(?:math[a-z]+|text[a-z]*|boldsymbol|bm|left|right|operatorname)(?![a-z])/g, ' ')
    .replace(/([A-Za-z0-9])_\{(\w+)\}/g, '$1_$2')

/** The words without duplicates, at most a dozen. */
function distinct(words) {
  return [...new Map(words.map((terms) => [terms[0], terms])).values()].slice(0, 12)
}

/** Look a word up, or, for an unknown name with dots, its parts. */
async function lookUpAll(terms, source) {
  const word = await lookUp(terms, source)
  const parts = terms[0].includes('.') && word.terms.size === 0 ? wordsOf(terms[0].replaceAll('.', ' ')) : []
  return parts.length > 0 ? Promise.all(parts.map((part) => lookUp(part, source))) : [word]
}

/** Look a word up: `pages` by number, each with its best value. */
async function lookUp(terms, source) {
  const [whole, ...parts] = terms
  const word = { whole, terms: new Map(), pages: new Map(), instead: null }
  const lines = await source.shard(shardOf(source.listing, whole))
  if (lines.has(whole)) add(word, whole, lines.get(whole), EXACT)
  if ([...whole].length >= BEGINNING || isRow(whole)) {
    const longerTerms = [...lines.keys()].filter((term) => term !== whole && term.startsWith(whole))
    for (const term of longerTerms.slice(0, MOST_BEGUN)) add(word, term, lines.get(term), PREFIX)
  } else {
    byTitle(word, source.listing, word.terms.size > 0 ? HINT : PREFIX)
  }
  if (word.terms.size === 0 && parts.length > 0) await byParts(word, parts, source)
  return word
}

const titles = new WeakMap() // list of pages → terms of each title

/** Match a short word, which may begin terms in any file, with titles only. */
function byTitle(word, listing, fit) {
  if (!titles.has(listing)) {
    titles.set(
      listing,
      listing.pages.map(([, , title]) => termsOf(title)),
    )
  }
  titles.get(listing).forEach((terms, page) => {
    for (const term of terms) {
      if (term === word.whole || !term.startsWith(word.whole)) continue
      if (fit === PREFIX) word.terms.set(term, fit)
      raise(word.pages, page, fit, TITLE)
    }
  })
}

/** Match a name with the pages that have every part of it. */
async function byParts(word, parts, source) {
  const lines = await Promise.all(parts.map(async (part) => (await source.shard(shardOf(source.listing, part))).get(part)))
  if (lines.includes(undefined)) return
  const pagesByPart = lines.map((line) => new Map(readPages(line)))
  const [smallest, ...rest] = pagesByPart
  for (const [page, weight] of smallest) {
    if (rest.every((pages) => pages.has(page))) raise(word.pages, page, PARTS, weight)
  }
  if (word.pages.size > 0) parts.forEach((part) => word.terms.set(part, PARTS))
}

/**
 * Look a word up in similar spellings, first among those with the same first letters; if `thorough`, then among all, as
 * the first letter may be wrong.
 */
async function respell(word, source, thorough) {
  if (tolerance(word.whole) === 0 || !isFuzzy(word.whole)) return
  const { listing } = source
  const likelyShards = new Set([...word.whole].slice(0, 2).map((letter) => spellingOf(listing, letter)))
  let candidates = likelyTerms(word.whole, await Promise.all([...likelyShards].map(source.spelling)))
  if (thorough && candidates.length === 0) {
    const everyShard = Array.from({ length: listing.words }, (_, index) => listing.terms + index)
    candidates = likelyTerms(word.whole, await Promise.all(everyShard.map(source.spelling)))
  }
  const shards = await Promise.all(candidates.map(([term]) => source.shard(shardOf(listing, term))))
  const found = candidates
    .map(([term, mistakes], index) => ({ term, mistakes, line: shards[index].get(term) }))
    .filter(({ line }) => line)
  for (const { term, mistakes, line } of found) add(word, term, line, MISSPELT[mistakes])
  if (!thorough || found.length === 0) return
  // Of terms that are as likely, the word is taken for the one of most pages.
  const likeliest = found.filter(({ term, mistakes }) => mistakes === found[0].mistakes && term[0] === found[0].term[0])
  const often = ({ line }) => readPages(line).length
  word.instead = likeliest.sort((a, b) => often(b) - often(a))[0].term
}

function add(word, term, line, fit) {
  word.terms.set(term, fit)
  for (const [page, weight] of readPages(line)) raise(word.pages, page, fit, weight)
}

function raise(pages, page, fit, weight) {
  const value = fit * FIELDS[weight >> 2] * (1 + OFTEN * (weight & 3))
  if (value > (pages.get(page) ?? 0)) pages.set(page, value)
}

/** The pages by score, those of equal score in the order of the course; planned lessons come last. */
function rankPages(words, listing) {
  const pageCount = listing.pages.length
  const rarity = words.map(({ pages }) => Math.log(1 + (pageCount - pages.size + 0.5) / (pages.size + 0.5)))
  const whole = rarity.reduce((sum, value) => sum + value, 0)
  const sums = new Map()
  words.forEach(({ pages }, index) => {
    for (const [page, value] of pages) {
      const sum = sums.get(page) ?? { page, kind: listing.kinds[listing.pages[page][1]], score: 0, share: 0, words: 0 }
      sum.score += value * rarity[index]
      sum.share += rarity[index] / whole
      sum.words += 1
      sums.set(page, sum)
    }
  })
  const names = new Set(words.map(({ whole }) => whole))
  for (const sum of sums.values()) {
    const name = listing.pages[sum.page][3]
    sum.score *= sum.share ** 2 * (KINDS[sum.kind] ?? OTHER)
    if (name && names.has(name.toLowerCase())) sum.score *= NAMED
  }
  return [...sums.values()].sort((a, b) => byRank(a, b) || a.page - b.page)
}
