/**
 * Extracts the terms of a text, by the same rules as coursebuild/features/search/words.py, which makes the index;
 * site/tests/search-words.json tests both.
 */

const LONGEST = 48
const LONGEST_NUMBER = 12
const SYLLABLE = 3 // characters; a name of shorter parts only, such as MuJoCo, has none

const SYMBOLS = {
  '∂': ['partial'],
  '∇': ['nabla', 'gradient'],
  '∫': ['integral', 'int'],
  '∮': ['integral', 'oint'],
  '∑': ['sum'],
  '∏': ['product', 'prod'],
  '√': ['sqrt', 'root'],
  '∞': ['infinity', 'infty'],
  '×': ['times'],
  '⋅': ['cdot'],
  '±': ['pm'],
  '≈': ['approx'],
  '≤': ['leq'],
  '≥': ['geq'],
  '∝': ['propto'],
  '⊗': ['otimes'],
  '⊥': ['perp'],
  '∥': ['parallel'],
}

const NAMES = (
  'alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma tau upsilon phi chi ' +
  'psi omega sigma epsilon theta phi pi rho'
).split(' ')
const GREEK = Object.fromEntries([...'αβγδεζηθικλμνξοπρστυφχψωςϵϑϕϖϱ'].map((letter, index) => [letter, NAMES[index]]))

const ROWS =
  '\\u0e00-\\u0eff\\u1000-\\u109f\\u1780-\\u17ff\\u3005-\\u3007\\u3040-\\u30ff' +
  '\\u3400-\\u4dbf\\u4e00-\\u9fff\\uf900-\\ufaff\\u{20000}-\\u{3ffff}'
const ROW = new RegExp(`^[${ROWS}]`, 'u')
const WORD = '[\\p{L}\\p{N}_]'
const TOKEN = new RegExp(
  `[0-9]+(?:\\.[0-9]+)*[eE][+-]?[0-9]+(?!${WORD})|${WORD}+(?:\\.${WORD}+)*|[${Object.keys(SYMBOLS).join('')}]`,
  'gu',
)
const RUN = new RegExp(`([${ROWS}]+)|([\\u0370-\\u03ff]+)|[^${ROWS}\\u0370-\\u03ff]+`, 'gu')
const NUMBER = /^[0-9][0-9.eE+-]*$/
const SEAM = /(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[A-Za-z])(?=[0-9])|(?<=[0-9])(?=[A-Za-z])|_+/
const GENITIVE = new RegExp(`['’]s(?!${WORD})`, 'gu')
const SIMPLE = /^[a-z]+$/
const ASCII = /^[\0-\x7f]*$/

/** The words, numbers, names and symbols of a text. */
function tokensOf(text) {
  let plain = text
  if (!ASCII.test(plain)) plain = plain.normalize('NFKD').replace(/\p{M}/gu, '')
  return plain.replace(GENITIVE, '').match(TOKEN) ?? []
}

/** The terms of a text, in order, with repeats. */
export function termsOf(text) {
  return tokensOf(text).flatMap(expand)
}

/**
 * The terms of a query, grouped by word: of each word the whole first, then its parts. In a script without spaces each
 * pair of characters is a word, and a single character only if it is alone.
 */
export function wordsOf(text) {
  return tokensOf(text).flatMap((token) => {
    const terms = expand(token)
    const pairs = terms.filter(isRow)
    const wholeTerms = terms.filter((term) => !isRow(term))
    const joinedTerm = wholeTerms.length > 1 && !ASCII.test(token) ? wholeTerms.pop() : null
    if (joinedTerm !== null) wholeTerms.unshift(joinedTerm)
    return [wholeTerms, ...pairs.filter((pair) => [...pair].length > 1 || pairs.length === 1).map((pair) => [pair])]
  }).filter((word) => word.length > 0)
}

/** Whether a term is of a script without spaces, where one character may begin others. */
export const isRow = (term) => ROW.test(term)

/**
 * The words of a text with their places, for marking. Places are in the original text, though terms are made from its
 * compatibility form.
 * @returns {{ start: number, end: number, terms: string[] }[]}
 */
export function placesOf(text) {
  const places = []
  const pieces = /[\p{L}\p{N}\p{M}_.]+|[^\s\p{L}\p{N}\p{M}_.]/gu
  for (const { 0: piece, index } of text.matchAll(pieces)) {
    const terms = termsOf(piece)
    if (terms.some(isRow)) places.push(...pairPlaces(piece, index))
    else if (terms.length > 0) places.push(...namePlaces(piece, index, terms))
  }
  return places
}

/** The places of a word; of a name with dots the whole and then its parts; of a number with dots only the whole. */
function namePlaces(piece, start, terms) {
  const whole = { start, end: start + piece.replace(/\.+$/, '').length, terms }
  if (!/[^.]\.[^.]/.test(piece) || NUMBER.test(piece)) return [whole]
  const parts = [...piece.matchAll(/[^.]+/g)].map(({ 0: part, index }) => ({
    start: start + index,
    end: start + index + part.length,
    terms: termsOf(part),
  }))
  return [{ ...whole, terms: terms.slice(0, 1) }, ...parts]
}

/** The places of every pair of characters in a script without spaces. */
function pairPlaces(piece, start) {
  let position = start
  const signs = [...piece].map((sign) => ({ sign, from: position, to: (position += sign.length) }))
  return signs.map(({ sign, from, to }, i) => {
    const next = signs[i + 1]
    return { start: from, end: next?.to ?? to, terms: termsOf(sign + (next?.sign ?? '')) }
  })
}

const cache = new Map()

function expand(token) {
  let terms = cache.get(token)
  if (terms === undefined) {
    if (cache.size > 20000) cache.clear()
    terms = [...new Set(makeTerms(token))]
    cache.set(token, terms)
  }
  return terms
}

function makeTerms(token) {
  if (SIMPLE.test(token)) return token.length <= LONGEST ? [token] : []
  if (Object.hasOwn(SYMBOLS, token)) return SYMBOLS[token]
  const name = token.replace(/^_+|_+$/g, '')
  if (name === '' || [...name].length > LONGEST) return []
  if (NUMBER.test(name)) return name.length <= LONGEST_NUMBER ? [name.toLowerCase()] : []
  return ASCII.test(name) ? latin(name) : mixed(name)
}

/** The terms of a name: the whole, and its parts. */
function latin(token) {
  const terms = [token.toLowerCase()]
  for (const segment of token.split('.')) {
    const name = segment.replace(/^_+|_+$/g, '')
    if (name.length > 1) terms.push(name.toLowerCase())
    const parts = name.split(SEAM).filter(Boolean)
    if (parts.length < 2 || (/^[A-Za-z]+$/.test(name) && parts.every((part) => part.length < SYLLABLE))) continue
    if (name.includes('_')) terms.push(name.toLowerCase().replaceAll('_', ''))
    terms.push(...parts.filter((part) => part.length > 1).map((part) => part.toLowerCase()))
  }
  return terms
}

/** The terms of a word with letters of other scripts. */
function mixed(token) {
  const runs = [...token.matchAll(RUN)]
  const terms = []
  const spelling = []
  for (const [run, row, greek] of runs) {
    const text = run.toLowerCase().normalize('NFC')
    if (row) {
      const signs = [...text]
      signs.forEach((sign, index) => terms.push(sign + (signs[index + 1] ?? '')))
    } else if (greek && Object.hasOwn(GREEK, text)) {
      spelling.push(GREEK[text])
      terms.push(GREEK[text])
    } else {
      const word = text.replaceAll('ς', 'σ').replace(/^[._]+|[._]+$/g, '')
      spelling.push(word)
      if (runs.length > 1 && [...word].length < 2) continue
      if (ASCII.test(word)) terms.push(...latin(run.replace(/^[._]+|[._]+$/g, '')))
      else terms.push(word)
    }
  }
  const whole = spelling.join('').replaceAll('_', '')
  if (spelling.length > 1 && [...whole].length <= LONGEST) terms.push(whole)
  return terms.filter(Boolean)
}

const isDigit = (sign) => sign >= '0' && sign <= '9'

/** The number of characters from which on longer terms are found by their beginning. */
export const BEGINNING = 4

/** The shelf of a term; terms of a shelf are in the same file: those that begin alike. Of a name with dots the last part counts. */
export function shelfOf(term) {
  if (isDigit(term[0])) return term
  if (ROW.test(term)) return [...term][0]
  const last = ASCII.test(term[0]) ? term.slice(term.lastIndexOf('.') + 1) : term
  return [...last].slice(0, BEGINNING).join('')
}

/** Whether a misspelt word may mean the term. */
export function isFuzzy(term) {
  const length = [...term].length
  return length >= 3 && length <= 24 && !term.includes('.') && !isDigit(term[0]) && !ROW.test(term)
}
