/** Orders of items, as lists of keys. Pure. */

/** Move an item by some places; it stops at the ends. */
export function moveBy(order, key, steps) {
  const index = order.indexOf(key)
  if (index < 0) return order
  return moveTo(order, key, index + steps)
}

/** Move an item to a place. */
export function moveTo(order, key, place) {
  const index = order.indexOf(key)
  if (index < 0) return order
  const rest = order.filter((item) => item !== key)
  const target = Math.min(Math.max(place, 0), rest.length)
  return [...rest.slice(0, target), key, ...rest.slice(target)]
}

/**
 * Adapt a stored order to the present items: removed ones are left out, new ones come at the end.
 * @param {unknown} storedOrder
 * @param {string[]} present
 */
export function restoreOrder(storedOrder, present) {
  if (!Array.isArray(storedOrder)) return [...present]
  const valid = [...new Set(storedOrder)].filter((key) => present.includes(key))
  return [...valid, ...present.filter((key) => !valid.includes(key))]
}

/**
 * The place for a dragged item: the number of other items whose middle is above the pointer.
 * @param {number} y of the pointer
 * @param {number[]} middles of the other items, in their order
 */
export function placeAt(y, middles) {
  return middles.filter((middle) => middle < y).length
}
