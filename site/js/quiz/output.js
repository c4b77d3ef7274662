/**
 * What a script prints in a line, compared with what a learner expects it to print.
 *
 *   gradeOutput('T = 2.0 s', 'T  = 2.00 s', compareBy('digits')) → { right: true }
 *
 * White space is folded. Numbers are compared as the recorded output is: to half a unit of the last place that was printed, within a
 * tolerance, or as equal values. Everything else is text.
 */

const NUMBER = /^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?/
const SIGNS = { '\u2212': '-', '\u2013': '-', '“': '"', '”': '"', '‘': "'", '’': "'" }

/**
 * How numbers are compared, as the page says it: `exact`, `digits`, or `rtol=1e-6 atol=1e-12`.
 * @returns {(given: string, printed: string) => boolean}
 */
export function compareBy(rule) {
  const [, rtol, atol] = /rtol=(\S+) atol=(\S+)/.exec(rule) ?? []
  return (given, printed) => {
    const off = Math.abs(Number(given) - Number(printed))
    if (rtol !== undefined) return off <= Number(atol) + Number(rtol) * Math.abs(Number(printed))
    if (rule !== 'digits' || !/[.eE]/.test(printed)) return off === 0
    return off <= (0.5 + 1e-9) * lastPlace(printed)
  }
}

/** A unit of the last place of a printed number. */
export function lastPlace(printed) {
  const [, part, exponent] = /^[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?$/.exec(printed)
  return 10 ** (Number(exponent ?? 0) - (printed.includes('.') ? part.length : 0))
}

/**
 * @returns {{right: boolean, near: '' | 'case' | 'space' | 'digits' | 'numbers'}} `near`: where only capitals, white space, the digits of
 *   a number or numbers at all are other
 */
export function gradeOutput(text, printed, same) {
  const given = tokens(text)
  const wanted = tokens(printed)
  const alike = (token, other) => token.text === other.text || (token.number && other.number && same(token.text, other.text))
  const all = (test) => given.length === wanted.length && given.every((token, i) => test(token, wanted[i]))
  if (all(alike)) return { right: true, near: '' }
  if (all((a, b) => alike(a, b) || a.text.toLowerCase() === b.text.toLowerCase())) return { right: false, near: 'case' }
  const numbers = (a, b) => a.text === b.text || (a.number && b.number)
  if (all((a, b) => numbers(a, b) && (!a.number || close(a.text, b.text)))) return { right: false, near: 'digits' }
  if (wanted.some((token) => !token.number) && all(numbers)) return { right: false, near: 'numbers' }
  const joined = (list) => list.map((token) => token.text).join('')
  return { right: false, near: joined(given) === joined(wanted) ? 'space' : '' }
}

/** Whether a number is another one rounded. */
function close(given, printed) {
  return Math.abs(Number(given) - Number(printed)) <= (0.5 + 1e-9) * lastPlace(given)
}

/** Words, numbers and signs, each by itself: white space only parts them. */
function tokens(text) {
  const source = [...text.normalize('NFC')].map((char) => SIGNS[char] ?? char).join('')
  const found = []
  let at = 0
  while (at < source.length) {
    const rest = source.slice(at)
    const space = /^\s+/.exec(rest)
    if (space) {
      at += space[0].length
      continue
    }
    // A sign belongs to a number where nothing stands before it.
    const before = source[at - 1] ?? ' '
    const number = /[\p{L}\d_.)\]]/u.test(before) ? null : NUMBER.exec(rest)
    const next = number && rest[number[0].length]
    const whole = number && !/[\p{L}\d_]/u.test(next ?? '') ? number[0] : null
    const token = whole ?? /^(?:[\p{L}\p{M}\d_]+|.)/su.exec(rest)[0]
    found.push({ text: token, number: whole !== null })
    at += token.length
  }
  return found
}
