/** Formats numbers for readers: with a real minus sign, the page's decimal sign, fixed digits, and a width that does not depend on the sign. */

const DECIMAL = globalThis.document?.documentElement.dataset.decimal ?? '.' // what is typed, exported and linked keeps the point
const FIGURE_SPACE = '\u2007'
const MINUS = '\u2212'

/**
 * A readout's value.
 *
 * @param {number | string | null} value NaN and `null`: none
 * @param {number | null} digits after the point; null: six significant figures
 */
export function formatReadout(value, digits) {
  if (typeof value === 'string') return value
  if (typeof value !== 'number' || Number.isNaN(value)) return '–'
  return formatNumber(value, digits)
}

/** A number with `digits` after the point, or to six significant figures; a plus takes as much room as a minus. */
export function formatNumber(value, digits) {
  if (Number.isNaN(value)) return 'NaN'
  if (!Number.isFinite(value)) return value > 0 ? '∞' : `${MINUS}∞`
  const size = Math.abs(value)
  let text
  if (digits === null || digits === undefined)
    text = isPlain(size) ? String(Number(size.toPrecision(6))) : scientific(size, 4)
  else text = size < 1e9 ? size.toFixed(digits) : scientific(size, Math.max(2, digits))
  // A number that is rounded to zero has no sign.
  const sign = value < 0 && /[1-9]/.test(text) ? MINUS : FIGURE_SPACE
  return sign + shown(text)
}

/** A number without padding, for a label: `−0.5`. */
export function formatLabel(value) {
  return (value < 0 ? MINUS : '') + shown(shortest(Math.abs(value)))
}

/** The digits after the point that are needed to tell the values of a slider apart. */
export function digitsOfStep(step) {
  if (!(step > 0)) return 2
  for (let digits = 0; digits < 10; digits++) {
    const multiple = step * 10 ** digits
    if (Math.abs(multiple - Math.round(multiple)) < 1e-6 * multiple) return digits
  }
  return 10
}

/** A number's text and its unit; only the degree stands at the digits. */
export const withUnit = (text, unit) => (unit ? `${text}${unit === '°' ? '' : '\u00a0'}${unit}` : text)

/** Simulated time, in hundredths of a second, or with more digits. */
export function formatTime(seconds, digits = 2) {
  return formatNumber(seconds, digits).trim()
}

/** One figure: `0.4` for 0.412, `0.03` for 0.0312. */
export function formatRough(value) {
  return formatLabel(Number(value.toPrecision(1)))
}

const shown = (text) => text.replace('.', DECIMAL)

const isPlain = (size) => size === 0 || (size >= 1e-4 && size < 1e7)

function shortest(size) {
  if (isPlain(size)) return String(Number(size.toPrecision(10)))
  const [mantissa, exponent] = size.toExponential(3).split('e')
  const power = `10${superscript(Number(exponent))}`
  return Number(mantissa) === 1 ? power : `${Number(mantissa)}·${power}`
}

function scientific(size, digits) {
  const [mantissa, exponent] = size.toExponential(digits).split('e')
  return `${mantissa}·10${superscript(Number(exponent))}`
}

const SUPERSCRIPTS = '⁰¹²³⁴⁵⁶⁷⁸⁹'

export function superscript(exponent) {
  const digits = [...String(Math.abs(exponent))].map((digit) => SUPERSCRIPTS[digit]).join('')
  return exponent < 0 ? `⁻${digits}` : digits
}
