/** Labels that must not lie on each other. */

/**
 * Move places apart along a line until each two are at least `gap` from each other, as little as can be, between `low` and `high`.
 *
 * @param {(number | null)[]} places null: nothing there
 * @returns {(number | null)[]}
 */
export function spread(places, gap, low, high) {
  const order = places.map((place, i) => ({ place, i })).filter(({ place }) => place !== null)
  order.sort((a, b) => a.place - b.place || a.i - b.i)
  // Groups of touching labels, each around the mean of what its members want.
  const groups = []
  for (const item of order) {
    groups.push({ items: [item], sum: item.place })
    for (;;) {
      const last = groups[groups.length - 1]
      const before = groups[groups.length - 2]
      if (before === undefined || start(last, gap) - end(before, gap) >= gap) break
      before.items.push(...last.items)
      before.sum += last.sum
      groups.pop()
    }
  }
  const result = places.map(() => null)
  for (const group of groups) {
    const first = Math.max(low, Math.min(start(group, gap), high - gap * (group.items.length - 1)))
    group.items.forEach(({ i }, k) => (result[i] = first + k * gap))
  }
  return result
}

const start = ({ items, sum }, gap) => sum / items.length - (gap * (items.length - 1)) / 2
const end = (group, gap) => start(group, gap) + gap * (group.items.length - 1)
