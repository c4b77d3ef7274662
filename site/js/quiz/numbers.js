/**
 * Reads numerals as people write them.
 *
 *   readNumeral('1 200,5') → { value: 1200.5, step: 0.1 }
 *
 * The rules for separators between digits:
 *
 * 1. A space or an apostrophe groups digits by three. Anywhere else it separates two numbers.
 * 2. A point and a comma together: the last one is the decimal sign, the other one groups by three.
 * 3. Several points, or several commas: they group by three.
 * 4. One point is the decimal point.
 * 5. One comma is the decimal comma, unless it may also group: one to three digits before it, the first not 0, and exactly three
 *    after it. Then it is ambiguous (`1,200`), and the learner is asked.
 */

const ZEROS = [0x660, 0x6f0, 0x966, 0x9e6, 0xe50, 0xff10] // of the decimal digits of other scripts that learners type
const SIGNS = {
  '\u2212': '-', '\u2010': '-', '\u2012': '-', '\u2013': '-', '\u2014': '-',
  '\u066b': '.', '\u066c': '\u2019', '\u060c': ',', '\u066a': '%',
  '\u00b7': '*', '\u22c5': '*', '\u2219': '*', '\u2022': '*', '\u2217': '*', '\u00d7': '*', '\u2715': '*', '\u2a2f': '*',
  '\u00f7': '/', '\u2215': '/', '\u2044': '/', '\u2032': "'", '\u02bc': "'",
}
const FRACTION = '[\u00bc-\u00be\u2150-\u215e\u2189]' // from ¼ to ↉
const MIXED = new RegExp(`((?<![\\d.,][ '’]?)\\d+(?: \\d{3})*)? ?(${FRACTION})`, 'gu')
const SUPERSCRIPTS = '⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻'
const PLAIN = '0123456789+-'

/** Replace signs and digits that mean the same by one of them: minus signs, multiplication dots, spaces, superscripts, fractions. */
export function normalise(text) {
  const plain = (digits) => [...digits].map((digit) => PLAIN[SUPERSCRIPTS.indexOf(digit)]).join('')
  const raised = text.replace(new RegExp(`[${SUPERSCRIPTS}]+`, 'g'), (digits) => `^${plain(digits)}`)
  const marked = raised
    .replace(MIXED, (_, whole, part, at) => (whole ? `(${whole}+${part})` : /[\d.,]$/.test(raised.slice(0, at)) ? ` ${part}` : `(${part})`))
    .replace(/[\u00ba\u02da]/g, '°')
  const characters = [...marked.normalize('NFKC')].map((char) => {
    if (char in SIGNS) return SIGNS[char]
    if (/\s|[\u200b\u2060\ufeff\u200e\u200f]/u.test(char)) return ' '
    const code = char.codePointAt(0)
    const zero = ZEROS.find((zero) => code >= zero && code < zero + 10)
    return zero === undefined ? char : String(code - zero)
  })
  return characters.join('').replace(/\*\*/g, '^').replace(/ +/g, ' ').trim()
}

/** The end of a numeral in a normalised text: its digits with all that may separate them. `start` if there is none. */
export function numeralEnd(text, start) {
  const match = /(?:\d|[.,]\d)(?:\d|[.,'’]\d| \d)*/y
  match.lastIndex = start
  const end = match.test(text) ? match.lastIndex : start
  return end > start && /[.]/.test(text[end] ?? '') && !/[.,]/.test(text.slice(start, end)) ? end + 1 : end
}

/** @typedef {{value?: number, step?: number, problem?: 'numbers' | 'numeral' | 'either', readings?: string[]}} Numeral */

/**
 * The value of a numeral.
 *
 * @param {string} text digits, points, commas, spaces, apostrophes
 * @returns {Numeral} `step`: a unit of its last
 *   place
 */
export function readNumeral(text) {
  const marks = [...text.matchAll(/[.,]/g)].map((match) => match[0])
  const last = marks.at(-1)
  const single = marks.filter((mark) => mark === last).length === 1
  if (marks.length === 0) return readGroups(text, '')
  if (!single) {
    // Several of one kind group; then there is no place for another kind before them.
    if (marks.some((mark) => mark !== last) || /[ '’]/.test(text)) return { problem: 'numeral' }
    const groups = text.split(last)
    return isGrouped(groups) ? number(groups.join(''), '') : { problem: 'numeral' }
  }
  const [whole, part] = splitAt(text, last)
  if (marks.length > 1) {
    const groups = whole.split(marks[0])
    return isGrouped(groups) && !/[ '’]/.test(text) ? number(groups.join(''), part) : { problem: 'numeral' }
  }
  if (last === ',' && /^[1-9]\d{0,2}$/.test(whole) && /^\d{3}$/.test(part)) {
    return { problem: 'either', readings: [whole + part, `${whole}.${part}`] }
  }
  return readGroups(whole, part)
}

function splitAt(text, mark) {
  const index = text.lastIndexOf(mark)
  return [text.slice(0, index), text.slice(index + 1)]
}

const isGrouped = (groups) => /^\d{1,3}$/.test(groups[0]) && groups.slice(1).every((group) => /^\d{3}$/.test(group))

/** Read the digits before and after the decimal sign, which may be grouped by spaces or apostrophes. @returns {Numeral} */
function readGroups(whole, part) {
  const wholeGroups = whole.split(/[ '’]/)
  const partGroups = part.split(/[ '’]/)
  const tail = partGroups.at(-1).length <= 3 && partGroups.slice(0, -1).every((group) => group.length === 3)
  if ((wholeGroups.length > 1 && !isGrouped(wholeGroups)) || (partGroups.length > 1 && !tail)) return { problem: 'numbers' }
  return number(wholeGroups.join(''), partGroups.join(''))
}

function number(whole, part) {
  return { value: Number(`${whole || 0}.${part || 0}`), step: 10 ** -part.length }
}
