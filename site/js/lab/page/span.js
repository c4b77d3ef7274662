/** The range of the linear axis of a plot, and places for its labels so that they do not overlap. */

const ROOM = 0.06 // on either side of the data, as part of their range
const FLAT = 0.05 // on either side of a flat line, as part of its value
const SEEN = 1e-10 // of the sum of two values: what differs by less is a flat line, as labels of ten figures cannot tell it apart
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
  if (marks.length === 0 && low == null) marks.push(0) // where a plot waits for its first sample
  const bottom = ymin ?? Math.min(low ?? Infinity, ...marks)
  const top = ymax ?? Math.max(high ?? -Infinity, ...marks)
  const seen = ymin === bottom && ymax === top ? 0 : SEEN * Math.abs(top + bottom)
  if (top - bottom > seen && Number.isFinite(top - bottom)) {
    const room = ROOM * (top - bottom)
    return [ymin ?? bottom - room, ymax ?? top + room]
  }
  // No data, a flat line, or all of the data beyond the author's bound: a range around that bound, or around the line.
  const middle = [ymin, ymax, bottom].find((y) => Number.isFinite(y)) ?? 0
  const room = middle === 0 ? 1 : Math.max(LEAST, FLAT * Math.abs(middle))
  return [ymin ?? middle - room, ymax ?? middle + room]
}

/**
 * Move places of labels apart along a line, as little as possible, until they are at least `gap` apart and between `low` and `high`.
 *
 * @param {(number | null)[]} places null: no label
 * @returns {(number | null)[]}
 */
export function spread(places, gap, low, high) {
  const order = places.map((place, i) => ({ place, i })).filter(({ place }) => place !== null)
  order.sort((a, b) => a.place - b.place || a.i - b.i)
  // Groups of touching labels, each centred on the mean of its members' places.
  const groups = []
  for (const item of order) {
    groups.push({ items: [item], sum: item.place })
    for (;;) {
      const last = groups[groups.length - 1]
      const previous = groups[groups.length - 2]
      if (previous === undefined || start(last, gap) - end(previous, gap) >= gap) break
      previous.items.push(...last.items)
      previous.sum += last.sum
      groups.pop()
    }
  }
  const result = places.map(() => null)
  for (const group of groups) {
    const position = Math.max(low, Math.min(start(group, gap), high - gap * (group.items.length - 1)))
    group.items.forEach(({ i }, k) => (result[i] = position + k * gap))
  }
  return result
}

const start = ({ items, sum }, gap) => sum / items.length - (gap * (items.length - 1)) / 2
const end = (group, gap) => start(group, gap) + gap * (group.items.length - 1)
