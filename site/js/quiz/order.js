/** Putting items in order: pure. Orders are lists of keys. */

/** The order after an item moved by some places; it stops at the ends. */
export function moved(order, key, by) {
  const from = order.indexOf(key)
  if (from < 0) return order
  return placed(order, key, from + by)
}

/** The order after an item was put at a place. */
export function placed(order, key, place) {
  const from = order.indexOf(key)
  if (from < 0) return order
  const rest = order.filter((other) => other !== key)
  const to = Math.min(Math.max(place, 0), rest.length)
  return [...rest.slice(0, to), key, ...rest.slice(to)]
}

/**
 * An order that was kept, for the items that there are now: those that have gone are left out, new ones come at the end.
 * @param {unknown} kept
 * @param {string[]} present
 */
export function restored(kept, present) {
  if (!Array.isArray(kept)) return [...present]
  const known = [...new Set(kept)].filter((key) => present.includes(key))
  return [...known, ...present.filter((key) => !known.includes(key))]
}

/**
 * The place for an item that is dragged: so many of the others have their middle above it.
 * @param {number} y of the pointer
 * @param {number[]} middles of the other items, in their order
 */
export function placeAt(y, middles) {
  return middles.filter((middle) => middle < y).length
}
