/** Writes values in the data types of SCORM 1.2 (Run-Time Environment, section 3.4.2.1). */

/** CMIString255. */
const SHORT = 255

/** A text without line ends and control characters, cut to 255 characters but not inside a surrogate pair. */
export function shortText(text) {
  const line = text.replace(/[\u0000-\u001f\u007f\u2028\u2029]+/g, ' ').trim()
  if (line.length <= SHORT) return line
  return line.slice(0, SHORT).replace(/[\ud800-\udbff]$/, '')
}

/** CMIIdentifier: printable ASCII without blanks, at most 255 characters; different texts get different identifiers unless they are cut. */
export function identifier(text) {
  return [...text].map((c) => (/[A-Za-z0-9.-]/.test(c) ? c : `_${c.codePointAt(0).toString(16)}_`)).join('').slice(-SHORT)
}

/** CMIDecimal: a number without an exponent, or `null` if it cannot be written so. */
export function decimal(text) {
  const number = text.trim().replace(/^\+/, '').replace('\u2212', '-').replace(',', '.')
  if (!/^-?(\d+\.?\d*|\.\d+)$/.test(number) || number.length > 30) return null
  return number.replace(/^(-?)\./, '$10.').replace(/\.$/, '')
}

/** CMITimespan, HHHH:MM:SS.SS, of a time in ms. */
export function timespan(ms) {
  const longest = 9999 * 3_600_000 + 59 * 60_000 + 59_990
  const hundredths = Math.floor(Math.min(Math.max(ms, 0), longest) / 10)
  const seconds = Math.floor(hundredths / 100)
  const parts = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60]
  const [h, m, s] = parts.map((part, n) => String(part).padStart(n ? 2 : 4, '0'))
  return `${h}:${m}:${s}.${String(hundredths % 100).padStart(2, '0')}`
}

/** CMITime, HH:MM:SS, of a moment, in local time. */
export function clock(date) {
  return [date.getHours(), date.getMinutes(), date.getSeconds()].map((part) => String(part).padStart(2, '0')).join(':')
}

const SIGNS = 'abcdefghijklmnopqrstuvwxyz0123456789'

/** The sign by which a response names the option or item at an index below 36; else `null`. */
export function signOf(index) {
  return SIGNS[index] ?? null
}
