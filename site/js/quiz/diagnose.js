/**
 * How a wrong number comes about.
 *
 *   nearMiss({ value: 80, step: 1 }, { answer: 0.08, tolerance: 0.0001, angle: false }) → 'ten'
 *
 * What is found is a kind of slip, never its size or direction: it says where to look, not what to enter. A slip is only believed where
 * the tolerance is narrow: with a wide one, too much is a factor of two away from something right.
 */

const NARROW = 0.2 // of the answer's size
const TENS = 15 // powers of ten that are looked at, in each direction
const CLOSE = 10 // tolerances
const CLOSE_SHARE = 0.05 // of the answer's size
const ROUNDED_SHARE = 0.3 // of the answer's size: what is further away is no rounded answer, but another number
const SLACK = 1e-12 // of the numbers' size: what binary fractions and calculations cannot keep

/** Whether a value is as close to the answer as asked for. */
export function within(value, answer, tolerance) {
  return Math.abs(value - answer) <= tolerance + SLACK * Math.max(Math.abs(value), Math.abs(answer))
}

/**
 * @param {{value: number, step: number | null}} given `step`: a unit of the last place that was written, in the answer's unit; null for
 *   a calculation
 * @param {{answer: number, tolerance: number, angle: boolean}} asked `angle`: whether it is in radians or degrees
 * @returns {'' | 'rounded' | 'close' | 'sign' | 'degrees' | 'radians' | 'ten' | 'two' | 'turn' | 'reciprocal'}
 */
export function nearMiss({ value, step }, { answer, tolerance, angle }) {
  const hits = (candidate) => within(candidate, answer, tolerance)
  if (isRounded(value, step, answer)) return 'rounded'
  const off = Math.abs(value - answer)
  if (answer !== 0 && off <= Math.min(CLOSE * tolerance, CLOSE_SHARE * Math.abs(answer))) return 'close'
  if (answer === 0 || value === 0 || tolerance > NARROW * Math.abs(answer)) return ''
  if (hits(-value)) return 'sign'
  if (angle && hits((value * Math.PI) / 180)) return 'degrees'
  if (angle && hits((value * 180) / Math.PI)) return 'radians'
  for (let exponent = 1; exponent <= TENS; exponent++) {
    if (hits(value * 10 ** exponent) || hits(value / 10 ** exponent)) return 'ten'
  }
  if (hits(value * 2) || hits(value / 2)) return 'two'
  if (hits(value * 2 * Math.PI) || hits(value / (2 * Math.PI))) return 'turn'
  if (hits(1 / value)) return 'reciprocal'
  return ''
}

/** Whether a numeral is the answer with fewer digits: rounded, or cut off behind its last place. */
function isRounded(value, step, answer) {
  if (step === null || value === 0 || step > Math.abs(value)) return false
  const off = Math.abs(value - answer)
  if (off > ROUNDED_SHARE * Math.abs(answer)) return false
  if (off <= step * (0.5 + 1e-9)) return true
  // Cut off: two digits at least, or it would be any number nearby.
  return Math.abs(value) < Math.abs(answer) && off < step * (1 - 1e-9) && Math.abs(value) >= 10 * step
}
