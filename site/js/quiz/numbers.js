/**
 * Numerals as people write them.
 *
 *   readNumeral('1 200,5') → { value: 1200.5, step: 0.1 }
 *
 * Exact rules for what separates digits:
 *
 * 1. A space or an apostrophe groups digits by three. Where it stands otherwise there are two numbers.
 * 2. A point and a comma together: the last one is the decimal sign, the other one groups by three.
 * 3. Several points, or several commas: they group by three.
 * 4. One point is the decimal point.
 * 5. One comma is the decimal comma, unless it may as well group: one to three digits before it, the first not 0, and exactly three
 *    behind. Then nobody can say what is meant (`1,200`), and it is asked.
 */

const ZEROS = [0x660, 0x6f0, 0x966, 0x9e6, 0xe50, 0xff10] // of the decimal digits of other scripts that learners type
const SIGNS = {
  '\u2212': '-', '\u2013': '-', '\ufe63': '-', '\uff0d': '-', '\u2010': '-', '\u2011': '-',
  '\uff0b': '+', '\u066b': '.', '\u066c': '\u2019', '\uff0e': '.', '\uff0c': ',', '\uff08': '(', '\uff09': ')',
  '\u00b7': '*', '\u22c5': '*', '\u2219': '*', '\u00d7': '*', '\u2217': '*', '\u00f7': '/', '\u2215': '/', '\u2044': '/',
  '\u2032': "'", '\u00b5': '\u03bc',
}
const RAISED = '⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻'
const PLAIN = '0123456789+-'

/** A text with the signs and digits that mean the same as one: minus signs, multiplication dots, spaces, raised exponents. */
export function normalise(text) {
  const one = [...text.normalize('NFC')].map((char) => {
    if (char in SIGNS) return SIGNS[char]
    if (/\s|[\u200b\u2060\ufeff\u200e\u200f]/u.test(char)) return ' '
    const code = char.codePointAt(0)
    const zero = ZEROS.find((zero) => code >= zero && code < zero + 10)
    return zero === undefined ? char : String(code - zero)
  })
  const raised = one.join('').replace(new RegExp(`[${RAISED}]+`, 'g'), (digits) =>
    `^${[...digits].map((digit) => PLAIN[RAISED.indexOf(digit)]).join('')}`)
  return raised.replace(/\*\*/g, '^').replace(/ +/g, ' ').trim()
}

/** Where a numeral in a normalised text ends: its digits with all that may separate them. `start` where there is none. */
export function numeralEnd(text, start) {
  const match = /(?:\d|[.,]\d)(?:\d|[.,'’]\d| \d)*/y
  match.lastIndex = start
  const end = match.test(text) ? match.lastIndex : start
  return end > start && /[.]/.test(text[end] ?? '') && !/[.,]/.test(text.slice(start, end)) ? end + 1 : end
}

/**
 * The value of a numeral.
 *
 * @param {string} text digits, points, commas, spaces, apostrophes
 * @returns {{value: number, step: number} | {problem: 'numbers' | 'numeral' | 'comma', readings?: string[]}} `step`: a unit of its last
 *   place
 */
export function readNumeral(text) {
  const marks = [...text.matchAll(/[.,]/g)].map((match) => match[0])
  const last = marks.at(-1)
  const single = marks.filter((mark) => mark === last).length === 1
  if (marks.length === 0) return grouped(text, '')
  if (!single) {
    // Several of one kind group; another one before them has no place.
    if (marks.some((mark) => mark !== last) || /[ '’]/.test(text)) return { problem: 'numeral' }
    const groups = text.split(last)
    return isGrouped(groups) ? number(groups.join(''), '') : { problem: 'numeral' }
  }
  const [whole, part] = cut(text, last)
  if (marks.length > 1) {
    const groups = whole.split(marks[0])
    return isGrouped(groups) && !/[ '’]/.test(text) ? number(groups.join(''), part) : { problem: 'numeral' }
  }
  if (last === ',' && /^[1-9]\d{0,2}$/.test(whole) && /^\d{3}$/.test(part)) {
    return { problem: 'comma', readings: [whole + part, `${whole}.${part}`] }
  }
  return grouped(whole, part)
}

function cut(text, mark) {
  const at = text.lastIndexOf(mark)
  return [text.slice(0, at), text.slice(at + 1)]
}

const isGrouped = (groups) => /^\d{1,3}$/.test(groups[0]) && groups.slice(1).every((group) => /^\d{3}$/.test(group))

/** Digits before and after the decimal sign, of which spaces or apostrophes may make groups. */
function grouped(whole, part) {
  const before = whole.split(/[ '’]/)
  const behind = part.split(/[ '’]/)
  const tail = behind.at(-1).length <= 3 && behind.slice(0, -1).every((group) => group.length === 3)
  if ((before.length > 1 && !isGrouped(before)) || (behind.length > 1 && !tail)) return { problem: 'numbers' }
  return number(before.join(''), behind.join(''))
}

function number(whole, part) {
  return { value: Number(`${whole || 0}.${part || 0}`), step: 10 ** -part.length }
}
