/**
 * Grades answers, by kind of question. Pure.
 *
 *   gradeChoice(entered, answers)   → { right, extra, missing }
 *   gradeNumber(text, expected)     → { state: 'right' | 'wrong' | 'unread', … }
 *   gradeOrder(entered, answers)    → { right, placedCount }
 *
 * output.js grades those to `output` questions.
 */

import { nearMiss, isWithin } from './diagnose.js'
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
 * @typedef {Record<string, any>} Expected
 * @property {number} answer in `unit`
 * @property {number} tolerance absolute, in `unit`
 * @property {string} unit as the author wrote it; empty: none
 */

/**
 * Grade a number, perhaps with a unit; without one it is in the expected unit.
 *
 * @param {string} text what the learner entered
 * @param {Expected} expected
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
