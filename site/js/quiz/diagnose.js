/**
 * Guesses how a wrong number came about.
 *
 *   nearMiss({ value: 80, step: 1 }, { answer: 0.08, tolerance: 0.0001, angle: false }) → 'ten'
 *
 * The result is a kind of slip, never its size or direction: it says where to look, not what to enter. Slips are only looked for if
 * the tolerance is narrow: with a wide one, too many numbers are, say, a factor of two away from a right one.
 */

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
