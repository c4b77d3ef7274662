/**
 * Compares a learner's prediction of a printed line with the line that the script prints.
 *
 *   gradeOutput('T = 2.0 s', 'T  = 2.00 s', compareBy('digits')) → { right: true }
 *
 * White space is folded. Numbers are compared like recorded outputs: to half a unit of the last printed place, within a tolerance, or
 * as equal values. Everything else is text.
 */

import { normalise } from './numbers.js'

const NUMBER = /^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?/
const QUOTES = { '“': '"', '”': '"', '‘': "'", '’': "'" }

/**
 * The comparison of numbers by the rule in the page: `exact`, `digits`, or `rtol=1e-6 atol=1e-12`.
 * @returns {(actual: string, expected: string) => boolean}
 */
export function compareBy(rule) {
  const [, rtol, atol] = /rtol=(\S+) atol=(\S+)/.exec(rule) ?? []
  return (actual, expected) => {
    const difference = Math.abs(Number(actual) - Number(expected))
    if (rtol !== undefined) return difference <= Number(atol) + Number(rtol) * Math.abs(Number(expected))
    if (rule !== 'digits' || !/[.eE]/.test(expected)) return difference === 0
    return difference <= (0.5 + 1e-9) * lastPlace(expected)
  }
}

/** A unit of the last place of a printed number. */
export function lastPlace(numeral) {
  const [, part, exponent] = /^[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?$/.exec(numeral)
  return 10 ** (Number(exponent ?? 0) - (numeral.includes('.') ? part.length : 0))
}

/**
 * @returns {{right: boolean, slip: '' | 'case' | 'space' | 'digits' | 'numbers'}} `slip`: only capitals, white space, the digits of
 *   a number, or only numbers differ
 */
export function gradeOutput(text, expected, isEqual) {
  const actualTokens = tokens(text)
  const expectedTokens = tokens(expected)
  const isAlike = (token, second) => token.text === second.text || (token.number && second.number && isEqual(token.text, second.text))
  const everyPair = (test) => actualTokens.length === expectedTokens.length && actualTokens.every((token, i) => test(token, expectedTokens[i]))
  if (everyPair(isAlike)) return { right: true, slip: '' }
  const pointed = text.replace(/(\d),(\d)/g, '$1.$2')
  if (pointed !== text && gradeOutput(pointed, expected, isEqual).right) return { right: true, slip: '' }
  if (everyPair((a, b) => isAlike(a, b) || a.text.toLowerCase() === b.text.toLowerCase())) return { right: false, slip: 'case' }
  const areNumbers = (a, b) => a.text === b.text || (a.number && b.number)
  if (everyPair((a, b) => areNumbers(a, b) && (!a.number || isRounding(a.text, b.text)))) return { right: false, slip: 'digits' }
  if (expectedTokens.some((token) => !token.number) && everyPair(areNumbers)) return { right: false, slip: 'numbers' }
  const textOf = (list) => list.map((token) => token.text).join('')
  return { right: false, slip: textOf(actualTokens) === textOf(expectedTokens) ? 'space' : '' }
}

/** Whether a number is the expected one rounded. */
function isRounding(actual, expected) {
  return Math.abs(Number(actual) - Number(expected)) <= (0.5 + 1e-9) * lastPlace(actual)
}

/** Split a text into words, numbers and signs; white space only separates them. */
function tokens(text) {
  const source = normalise(text).replace(/[“”‘’]/g, (quote) => QUOTES[quote])
  const list = []
  let index = 0
  while (index < source.length) {
    const rest = source.slice(index)
    const space = /^\s+/.exec(rest)
    if (space) {
      index += space[0].length
      continue
    }
    // A sign belongs to the number after it unless a word or number precedes it.
    const previous = source[index - 1] ?? ' '
    const number = /[\p{L}\d_.)\]]/u.test(previous) ? null : NUMBER.exec(rest)
    const next = number && rest[number[0].length]
    const whole = number && !/[\p{L}\d_]/u.test(next ?? '') ? number[0] : null
    const token = whole ?? /^(?:[\p{L}\p{M}\d_]+|.)/su.exec(rest)[0]
    list.push({ text: token, number: whole !== null })
    index += token.length
  }
  return list
}
