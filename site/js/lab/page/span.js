/** How far the linear axis of a plot reaches. */

const ROOM = 0.06 // on either side of the data, as part of their range
const FLAT = 0.05 // on either side of a flat line, as part of its value
const LEAST = 1e-9

/**
 * Bounds that the author leaves open follow the data and the reference lines, with room on both sides; a flat line gets a scale too.
 *
 * @param {{ymin?: number | null, ymax?: number | null, refLines?: {y: number}[]}} plot
 * @param {number | null | undefined} low @param {number | null | undefined} high of the data; nothing before there are any
 * @returns {[number, number]}
 */
export function spanOf({ ymin, ymax, refLines = [] }, low, high) {
  const marks = refLines.map(({ y }) => y)
  const least = ymin ?? Math.min(low ?? Infinity, ...marks)
  const most = ymax ?? Math.max(high ?? -Infinity, ...marks)
  if (most > least && Number.isFinite(most - least)) {
    const room = ROOM * (most - least)
    return [ymin ?? least - room, ymax ?? most + room]
  }
  // Nothing, a flat line, or all of it beyond the bound that is given: around that bound, or around the line.
  const middle = [ymin, ymax, least].find((y) => Number.isFinite(y)) ?? 0
  const room = middle === 0 ? 1 : Math.max(LEAST, FLAT * Math.abs(middle))
  return [ymin ?? middle - room, ymax ?? middle + room]
}
