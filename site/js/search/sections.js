/**
 * Finds the sections of a page for a query, and makes their excerpts. The text of a page is an array of sections,
 * `[anchor, heading, level, [[kind, text], …], also]`, with kinds `t` text, `f` formula, `c` code, `o` output.
 */

import MiniSearch from 'minisearch'
import { placesOf, termsOf } from './words.js'

const ROOM = 150 // characters of an excerpt
const BEFORE = 50 // of them before the first match
const PHRASE = [1, 1.35, 1.7] // factor for words in sequence: nowhere, in a text, in a heading
const CODE = new Set(['c', 'o'])

/** Prepare a page's text for the search. */
export function openPage(sections) {
  const finder = new MiniSearch({
    fields: ['heading', 'text', 'code'],
    tokenize: (text) => text.split(' '),
    processTerm: (term) => term,
    searchOptions: { boost: { heading: 3, text: 1, code: 0.6 } },
  })
  const termTexts = sections.map(([, heading, , pieces, also], id) => ({
    id,
    heading: termText(heading),
    text: termText(texts(pieces, false)),
    code: termText(`${texts(pieces, true)}\n${also}`),
  }))
  finder.addAll(termTexts)
  return { sections, termTexts, finder }
}

const texts = (pieces, code) =>
  pieces
    .filter(([kind]) => CODE.has(kind) === code)
    .map(([, text]) => text)
    .join('\n')
const termText = (text) => termsOf(text).join(' ')

/**
 * The sections of a page by the number of the query's words in them, then by score.
 * @param {ReturnType<typeof openPage>} page
 * @param {{ whole: string, terms: Map<string, number> }[]} words as `findPages` returns them
 */
export function findSections(page, words) {
  const queries = words
    .filter(({ terms }) => terms.size > 0)
    .map(({ terms }) => ({
      combineWith: /** @type {'OR'} */ ('OR'),
      queries: [...terms].map(([term, fit]) => ({ queries: [term], boostTerm: () => fit })),
    }))
  if (queries.length === 0) return []
  const hits = page.finder.search({ combineWith: 'OR', queries })
  const countWords = (result) => words.filter(({ terms }) => result.terms.some((term) => terms.has(term))).length
  return hits
    .map((result) => ({ at: result.id, score: result.score, words: countWords(result) }))
    .sort((a, b) => b.words - a.words || b.score - a.score || a.at - b.at)
}

/** The factor of a page's score for words of the query that follow each other. */
export function phraseFactor(page, title, words) {
  const pairs = words.slice(1).map(({ whole }, index) => ` ${words[index].whole} ${whole} `)
  const has = (text) => pairs.filter((pair) => ` ${text} `.includes(pair)).length
  if (pairs.length === 0) return 1
  if (has(termText(title)) || page.termTexts.some(({ heading }) => has(heading))) return PHRASE[2]
  return page.termTexts.some(({ text, code }) => has(text) || has(code)) ? PHRASE[1] : PHRASE[0]
}

/** The headings of a section's ancestors, outermost first, and its own. */
export function trail(sections, index) {
  const path = []
  for (let i = index, level = Infinity; i >= 0; i--) {
    const [, heading, headingLevel] = sections[i]
    if (headingLevel > 0 && headingLevel < level) {
      if (heading) path.unshift(heading)
      level = headingLevel
    }
  }
  return path
}

/**
 * A few words of a section around its best match.
 * @returns {{ code: boolean, parts: { text: string, marked: boolean }[] } | null}
 */
export function excerpt([, , , pieces], words) {
  let best = null
  for (const [kind, text] of pieces) {
    const places = marks(text, words)
    const many = new Set(places.flatMap(({ words: indices }) => indices)).size
    if (places.length > 0 && many > (best?.many ?? 0)) best = { kind, text, places, many }
  }
  if (best === null) {
    const firstText = pieces.find(([kind]) => kind === 't')
    return firstText ? makeExcerpt(firstText[1], [], false) : null
  }
  return makeExcerpt(best.text, best.places, CODE.has(best.kind))
}

/** Mark the words of a query in a text. */
export const markWords = (text, words) => split(text, marks(text, words), 0, text.length)

/** The places of a query's words in a text. */
function marks(text, words) {
  const spans = []
  for (const { start, end, terms } of placesOf(text)) {
    const indices = words.flatMap((word, index) => (terms.some((term) => word.terms.has(term)) ? [index] : []))
    if (indices.length > 0) spans.push({ start, end, words: indices })
  }
  return spans
}

function makeExcerpt(text, places, code) {
  const focus = densest(places)
  if (code) {
    const begin = text.lastIndexOf('\n', focus) + 1
    const start = begin + text.slice(begin, focus).search(/\S|$/)
    const line = text.indexOf('\n', focus)
    const end = Math.min(line < 0 ? text.length : line, Math.max(start, focus - BEFORE) + ROOM)
    return { code, parts: split(text, places, Math.max(start, focus - BEFORE), end) }
  }
  let start = focus <= BEFORE ? 0 : Math.max(text.lastIndexOf(' ', focus - BEFORE) + 1, focus - 2 * BEFORE)
  let end = start + ROOM >= text.length ? text.length : text.lastIndexOf(' ', start + ROOM)
  if (end <= focus) end = Math.min(text.length, start + ROOM)
  start = wholeCharacter(text, start)
  end = wholeCharacter(text, end)
  const parts = split(text, places, start, end)
  if (start > 0) parts.unshift({ text: '… ', isMarked: false })
  if (end < text.length) parts.push({ text: ' …', isMarked: false })
  return { code, parts }
}

/** The start of the excerpt with the most different words. */
function densest(places) {
  let bestStart = places[0]?.start ?? 0
  let max = 0
  for (const { start } of places) {
    const nearby = places.filter((place) => place.start >= start && place.end <= start + ROOM - BEFORE)
    const many = new Set(nearby.flatMap(({ words }) => words)).size
    if (many > max) [bestStart, max] = [start, many]
  }
  return bestStart
}

/** The index, moved back if it splits a surrogate pair. */
const wholeCharacter = (text, index) => (/[\udc00-\udfff]/.test(text[index] ?? '') ? index - 1 : index)

function split(text, places, start, end) {
  const parts = []
  let position = start
  for (const place of places) {
    if (place.end <= position || place.start >= end) continue
    const matchStart = Math.max(position, place.start)
    if (matchStart > position) parts.push({ text: text.slice(position, matchStart), isMarked: false })
    parts.push({ text: text.slice(matchStart, Math.min(end, place.end)), isMarked: true })
    position = Math.min(end, place.end)
  }
  if (position < end) parts.push({ text: text.slice(position, end), isMarked: false })
  return parts
}
