/**
 * Whether an answer is right, and what can be said of it: pure, by kind of question.
 *
 *   gradeChoice(given, answers)     → { right, extra, missing }
 *   gradeNumber(text, asked)        → { state: 'right' | 'wrong' | 'unread', … }
 *   gradeOrder(given, answers)      → { right, placed }
 *
 * Those of `output` questions are in output.js.
 */

import { nearMiss, within } from './diagnose.js'
import { readQuantity } from './expressions.js'
import { hasAngle, plain, readUnit, relation } from './units.js'

/**
 * Options chosen, by their keys.
 * @returns {{right: boolean, extra: number, missing: number}} so many were chosen that do not belong, so many that belong were not
 */
export function gradeChoice(given, answers) {
  const chosen = new Set(given)
  const right = new Set(answers)
  const extra = [...chosen].filter((key) => !right.has(key)).length
  const missing = [...right].filter((key) => !chosen.has(key)).length
  return { right: extra === 0 && missing === 0, extra, missing }
}

/**
 * Items in an order, by their keys.
 * @returns {{right: boolean, placed: number}} so many stand where they belong
 */
export function gradeOrder(given, answers) {
  const placed = answers.filter((key, place) => given[place] === key).length
  return { right: placed === answers.length && given.length === answers.length, placed }
}

/**
 * @typedef {object} Asked
 * @property {number} answer in `unit`
 * @property {number} tolerance absolute, in `unit`
 * @property {string} unit as the author wrote it; empty: none
 */

/**
 * A number, perhaps with a unit; without one it is in the unit that is asked for.
 *
 * @param {string} text what the learner entered
 * @param {Asked} asked
 * @returns {{state: 'right', value: number, converted: boolean}
 *   | {state: 'wrong', near: string, value: number, converted: boolean}
 *   | {state: 'unread', problem: string, detail: string, readings: string[]}}
 *   `value` in the unit that is asked for; `converted`: it is not what stands there, since it was computed or in another unit. `near`: see
 *   `nearMiss`, besides `unit` (it measures something else) and `scale` (the number is right in the unit that is asked for, not in the
 *   one that was written)
 */
export function gradeNumber(text, { answer, tolerance, unit }) {
  const read = readQuantity(text)
  if (read.problem) return { state: 'unread', problem: read.problem, detail: read.detail, readings: read.readings }
  const related = relate(read.unit, unit)
  if (related.problem) return { state: 'unread', problem: related.problem, detail: read.unit, readings: [] }
  if (related.fits === false) return { state: 'wrong', near: 'unit', value: read.value, converted: false }
  const { factor, offset } = related
  const value = read.value * factor + offset
  const step = read.step === null ? null : read.step * factor
  const converted = read.step === null || factor !== 1 || offset !== 0
  if (!Number.isFinite(value)) return { state: 'unread', problem: 'finite', detail: '', readings: [] }
  if (within(value, answer, tolerance)) return { state: 'right', value, converted }
  const scaled = Math.abs(factor - 1) > 1e-9 || offset !== 0
  const angle = hasAngle(readUnit(unit))
  const near = scaled && within(read.value, answer, tolerance) ? 'scale' : nearMiss({ value, step }, { answer, tolerance, angle })
  return { state: 'wrong', near, value, converted }
}

/** How what was written beside a number becomes what is asked for. */
function relate(written, asked) {
  const same = { factor: 1, offset: 0 }
  if (written === '' || plain(written) === plain(asked)) return same
  const given = readUnit(written)
  const known = readUnit(asked)
  if (given.length === 0) return { problem: /[\d+]/.test(plain(written).replace(/\^?\(?-?\d+(?:\/\d+)?\)?/g, '')) ? 'sign' : 'unit' }
  // The author's unit is one that nobody knows, or the question is for a number alone.
  if (known.length === 0) return { fits: false }
  const related = relation(given, known)
  if (related !== null) return related
  return asked.trim() === '' ? { problem: 'no_unit' } : { fits: false }
}
