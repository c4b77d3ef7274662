/**
 * Which sections of a page a query means, and what to show of them. The text of a page is an array of sections,
 * `[anchor, heading, level, [[kind, text], …], also]`, with kinds `t` text, `f` formula, `c` code, `o` output.
 */

import MiniSearch from 'minisearch'
import { placesOf, termsOf } from './words.js'

const ROOM = 150 // characters of an excerpt
const BEFORE = 50 // of them before the first match
const PHRASE = [1, 1.35, 1.7] // for words that follow each other: nowhere, in a text, in a heading
const CODE = new Set(['c', 'o'])

/** A page's text, ready to be searched. */
export function openPage(sections) {
  const finder = new MiniSearch({
    fields: ['heading', 'text', 'code'],
    tokenize: (text) => text.split(' '),
    processTerm: (term) => term,
    searchOptions: { boost: { heading: 3, text: 1, code: 0.6 } },
  })
  const said = sections.map(([, heading, , pieces, also], id) => ({
    id,
    heading: joined(heading),
    text: joined(texts(pieces, false)),
    code: joined(`${texts(pieces, true)}\n${also}`),
  }))
  finder.addAll(said)
  return { sections, said, finder }
}

const texts = (pieces, code) =>
  pieces
    .filter(([kind]) => CODE.has(kind) === code)
    .map(([, text]) => text)
    .join('\n')
const joined = (text) => termsOf(text).join(' ')

/**
 * The sections of a page that have most of a query, the best first.
 * @param {ReturnType<typeof openPage>} page
 * @param {{ whole: string, terms: Map<string, number> }[]} words as `findPages` gives them
 */
export function findSections(page, words) {
  const queries = words
    .filter(({ terms }) => terms.size > 0)
    .map(({ terms }) => ({
      combineWith: 'OR',
      queries: [...terms].map(([term, fit]) => ({ queries: [term], boostTerm: () => fit })),
    }))
  if (queries.length === 0) return []
  const found = page.finder.search({ combineWith: 'OR', queries })
  const many = (result) => words.filter(({ terms }) => result.terms.some((term) => terms.has(term))).length
  return found
    .map((result) => ({ at: result.id, score: result.score, words: many(result) }))
    .sort((a, b) => b.words - a.words || b.score - a.score || a.at - b.at)
}

/** How much more a page counts because words of the query follow each other on it. */
export function phraseFactor(page, title, words) {
  const pairs = words.slice(1).map(({ whole }, at) => ` ${words[at].whole} ${whole} `)
  const has = (text) => pairs.filter((pair) => ` ${text} `.includes(pair)).length
  if (pairs.length === 0) return 1
  if (has(joined(title)) || page.said.some(({ heading }) => has(heading))) return PHRASE[2]
  return page.said.some(({ text, code }) => has(text) || has(code)) ? PHRASE[1] : PHRASE[0]
}

/** The headings above a section, outermost first, with its own. */
export function trail(sections, at) {
  const path = []
  for (let i = at, level = Infinity; i >= 0; i--) {
    const [, heading, own] = sections[i]
    if (own > 0 && own < level) {
      if (heading) path.unshift(heading)
      level = own
    }
  }
  return path
}

/**
 * A few words of a section around what was found.
 * @returns {{ code: boolean, parts: { text: string, marked: boolean }[] } | null}
 */
export function excerpt([, , , pieces], words) {
  let chosen = null
  for (const [kind, text] of pieces) {
    const places = marks(text, words)
    const many = new Set(places.flatMap(({ words: of }) => of)).size
    if (places.length > 0 && many > (chosen?.many ?? 0)) chosen = { kind, text, places, many }
  }
  if (chosen === null) {
    const first = pieces.find(([kind]) => kind === 't')
    return first ? cut(first[1], [], false) : null
  }
  return cut(chosen.text, chosen.places, CODE.has(chosen.kind))
}

/** Text with what was found of a query marked. */
export const marked = (text, words) => split(text, marks(text, words), 0, text.length)

/** Where words of a query stand in a text. */
function marks(text, words) {
  const found = []
  for (const { start, end, terms } of placesOf(text)) {
    const of = words.flatMap((word, at) => (terms.some((term) => word.terms.has(term)) ? [at] : []))
    if (of.length > 0) found.push({ start, end, words: of })
  }
  return found
}

function cut(text, places, code) {
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
  start = whole(text, start)
  end = whole(text, end)
  const parts = split(text, places, start, end)
  if (start > 0) parts.unshift({ text: '… ', marked: false })
  if (end < text.length) parts.push({ text: ' …', marked: false })
  return { code, parts }
}

/** The place after which most different words stand within an excerpt. */
function densest(places) {
  let chosen = places[0]?.start ?? 0
  let most = 0
  for (const { start } of places) {
    const near = places.filter((place) => place.start >= start && place.end <= start + ROOM - BEFORE)
    const many = new Set(near.flatMap(({ words }) => words)).size
    if (many > most) [chosen, most] = [start, many]
  }
  return chosen
}

/** Never between the halves of a character. */
const whole = (text, at) => (/[\udc00-\udfff]/.test(text[at] ?? '') ? at - 1 : at)

function split(text, places, start, end) {
  const parts = []
  let at = start
  for (const place of places) {
    if (place.end <= at || place.start >= end) continue
    const from = Math.max(at, place.start)
    if (from > at) parts.push({ text: text.slice(at, from), marked: false })
    parts.push({ text: text.slice(from, Math.min(end, place.end)), marked: true })
    at = Math.min(end, place.end)
  }
  if (at < end) parts.push({ text: text.slice(at, end), marked: false })
  return parts
}
