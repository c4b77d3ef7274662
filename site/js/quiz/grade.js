/**
 * Grades answers, by kind of question. Pure.
 *
 *   gradeChoice(entered, answers)   → { right, extra, missing }
 *   gradeNumber(text, expected)     → { state: 'right' | 'wrong' | 'unread', … }
 *   gradeOrder(entered, answers)    → { right, placedCount }
 *
 * output.js grades those to `output` questions.
 */

import { readQuantity } from './expressions.js'
import { normalise } from './numbers.js'
import { hasAngle, plain, readUnit, relation } from './units.js'

/**
 * Grade a choice of options, by their keys.
 * @returns {{right: boolean, extra: number, missing: number}} the numbers of wrong options chosen, and of right ones not chosen
 */
export function gradeChoice(entered, answers) {
  const selected = new Set(entered)
  const right = new Set(answers)
  const extra = [...selected].filter((key) => !right.has(key)).length
  const missing = [...right].filter((key) => !selected.has(key)).length
  return { right: extra === 0 && missing === 0, extra, missing }
}

/**
 * Grade an order of items, by their keys.
 * @returns {{right: boolean, placedCount: number}} the number of items in their right place
 */
export function gradeOrder(entered, answers) {
  const placedCount = answers.filter((key, place) => entered[place] === key).length
  return { right: placedCount === answers.length && entered.length === answers.length, placedCount }
}

/**
 * Grade a number, perhaps with a unit; without one it is in the expected unit.
 *
 * @param {string} text what the learner entered
 * @param {{answer: number, tolerance: number, unit: string}} expected both in `unit`, as the author wrote it; empty: none
 * @returns {{state: 'right', slip?: undefined, value: number, converted: boolean}
 *   | {state: 'wrong', slip: string, value: number, converted: boolean}
 *   | {state: 'unread', problem: string, detail: string, readings: string[]}}
 *   `value` in the expected unit; `converted`: it was computed, or entered in another unit. `slip`: one of `nearMiss`, or `unit` (the
 *   unit measures something else), or `scale` (the number is right in the expected unit, but not in the entered one)
 */
export function gradeNumber(text, { answer, tolerance, unit }) {
  const read = readQuantity(text)
  if (read.problem) return { state: 'unread', problem: read.problem, detail: read.detail, readings: read.readings }
  const conversion = relate(read.unit, unit)
  if (conversion.problem) return { state: 'unread', problem: conversion.problem, detail: read.unit, readings: [] }
  if (conversion.fits === false) return { state: 'wrong', slip: 'unit', value: read.value, converted: false }
  const { factor, offset } = conversion
  const value = read.value * factor + offset
  const step = read.step === null ? null : read.step * factor
  const converted = read.step === null || factor !== 1 || offset !== 0
  if (!Number.isFinite(value)) return { state: 'unread', problem: 'finite', detail: '', readings: [] }
  if (isWithin(value, answer, tolerance)) return { state: 'right', value, converted }
  // A point that may have separated thousands, where the number would then be right.
  const [detail, whole, part] = /(?<![\d.,])([1-9]\d{0,2})\.(\d{3})(?![\d.,])/.exec(normalise(text)) ?? []
  if (detail && read.step !== null && isWithin(value * 1000, answer, tolerance)) {
    return { state: 'unread', problem: 'either', detail, readings: [`${whole}${part}`, `${detail}0`] }
  }
  const isScaled = Math.abs(factor - 1) > 1e-9 || offset !== 0
  const angle = hasAngle(readUnit(unit))
  const slip = isScaled && isWithin(read.value, answer, tolerance) ? 'scale' : nearMiss({ value, step }, { answer, tolerance, angle })
  return { state: 'wrong', slip, value, converted }
}

/** The conversion from the unit that was written to the expected one. */
function relate(writtenUnit, expectedUnit) {
  const identity = { factor: 1, offset: 0 }
  if (writtenUnit === '' || plain(writtenUnit) === plain(expectedUnit)) return identity
  const writtenReadings = readUnit(writtenUnit)
  const expectedReadings = readUnit(expectedUnit)
  if (writtenReadings.length === 0) return { problem: /[\d+]/.test(plain(writtenUnit).replace(/\^?\(?-?\d+(?:\/\d+)?\)?/g, '')) ? 'sign' : 'unit' }
  // The author's unit is unknown.
  if (expectedReadings.length === 0) return { fits: false }
  const conversion = relation(writtenReadings, expectedReadings)
  if (conversion !== null) return conversion
  return expectedUnit.trim() === '' ? { problem: 'no_unit' } : { fits: false }
}

// --- guesses how a wrong number came about: of which kind the slip is, never its size or direction. Slips are only looked for if the
// tolerance is narrow: with a wide one, too many numbers are, say, a factor of two away from a right one.

const NARROW = 0.2 // of the answer's size
const TENS = 15 // powers of ten that are tried, in each direction
const CLOSE = 10 // tolerances
const CLOSE_SHARE = 0.05 // of the answer's size
const ROUNDED_SHARE = 0.3 // of the answer's size: a number that is further away is not a rounded answer
const SLACK = 1e-12 // of the numbers' size: rounding errors

/** Whether a value is within the tolerance of the answer. */
export function isWithin(value, answer, tolerance) {
  return Math.abs(value - answer) <= tolerance + SLACK * Math.max(Math.abs(value), Math.abs(answer))
}

/**
 * @param {{value: number, step: number | null}} entry `step`: a unit of its last digit, in the answer's unit; null for a calculation
 * @param {{answer: number, tolerance: number, angle: boolean}} expected `angle`: whether it is in radians or degrees
 * @returns {'' | 'rounded' | 'close' | 'sign' | 'degrees' | 'radians' | 'ten' | 'signed_ten' | 'two' | 'turn' | 'reciprocal'}
 */
export function nearMiss({ value, step }, { answer, tolerance, angle }) {
  const hits = (candidate) => isWithin(candidate, answer, tolerance)
  if (isRounded(value, step, answer)) return 'rounded'
  const difference = Math.abs(value - answer)
  if (answer !== 0 && difference <= Math.min(CLOSE * tolerance, CLOSE_SHARE * Math.abs(answer))) return 'close'
  if (answer === 0 || value === 0 || tolerance > NARROW * Math.abs(answer)) return ''
  if (hits(-value)) return 'sign'
  if (angle && hits((value * Math.PI) / 180)) return 'degrees'
  if (angle && hits((value * 180) / Math.PI)) return 'radians'
  const isShifted = (number) =>
    Array.from({ length: TENS }, (_, index) => 10 ** (index + 1)).some((power) => hits(number * power) || hits(number / power))
  if (isShifted(value)) return 'ten'
  if (isShifted(-value)) return 'signed_ten'
  if (hits(value * 2) || hits(value / 2)) return 'two'
  if (hits(value * 2 * Math.PI) || hits(value / (2 * Math.PI))) return 'turn'
  if (hits(1 / value)) return 'reciprocal'
  return ''
}

/** Whether a numeral is the answer with fewer digits: rounded or truncated. */
function isRounded(value, step, answer) {
  if (step === null || value === 0 || step > Math.abs(value)) return false
  const difference = Math.abs(value - answer)
  if (difference > ROUNDED_SHARE * Math.abs(answer)) return false
  if (difference <= step * (0.5 + 1e-9)) return true
  // Truncated: at least two digits, or it would be any number nearby.
  return Math.abs(value) < Math.abs(answer) && difference < step * (1 - 1e-9) && Math.abs(value) >= 10 * step
}
