/** The range of the linear axis of a plot. */

const ROOM = 0.06 // on either side of the data, as part of their range
const FLAT = 0.05 // on either side of a flat line, as part of its value
const LEAST = 1e-9

/**
 * Bounds that the author leaves open follow the data and the reference lines, with room on both sides.
 *
 * @param {{ymin?: number | null, ymax?: number | null, refLines?: {y: number}[]}} plot
 * @param {number | null | undefined} low @param {number | null | undefined} high of the data, if there are any
 * @returns {[number, number]}
 */
export function spanOf({ ymin, ymax, refLines = [] }, low, high) {
  const marks = refLines.map(({ y }) => y)
  const bottom = ymin ?? Math.min(low ?? Infinity, ...marks)
  const top = ymax ?? Math.max(high ?? -Infinity, ...marks)
  if (top > bottom && Number.isFinite(top - bottom)) {
    const room = ROOM * (top - bottom)
    return [ymin ?? bottom - room, ymax ?? top + room]
  }
  // No data, a flat line, or all of the data beyond the author's bound: a range around that bound, or around the line.
  const middle = [ymin, ymax, bottom].find((y) => Number.isFinite(y)) ?? 0
  const room = middle === 0 ? 1 : Math.max(LEAST, FLAT * Math.abs(middle))
  return [ymin ?? middle - room, ymax ?? middle + room]
}
