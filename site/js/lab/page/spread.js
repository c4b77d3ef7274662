/** Places labels so that they do not overlap. */

/**
 * Move places apart along a line, as little as possible, until they are at least `gap` apart and between `low` and `high`.
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
