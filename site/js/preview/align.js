/**
 * Aligns two lists: finds which items stayed, changed, went and came.
 *
 *   align(before, after, same, alike) → [[i, j], …]
 *
 * In order; `i` is null for an item that came, `j` for one that went. Equal items are paired first, as many as possible without
 * crossing; between them, items that are alike.
 */

const LARGEST = 250_000 // pairs that are compared; of larger lists only equal beginnings and ends are paired

export function align(before, after, same, alike) {
  const pairs = []
  let last = /** @type {[number, number]} */ ([0, 0])
  for (const [i, j] of [...inOrder(before, after, same), [before.length, after.length]]) {
    pairs.push(...alignGap(before, after, last, [i, j], alike))
    if (i < before.length) pairs.push([i, j])
    last = [i + 1, j + 1]
  }
  return pairs
}

/** Align the items between two pairs: those that are alike are paired, the rest went or came. */
function alignGap(before, after, [i0, j0], [i1, j1], alike) {
  const matches = inOrder(before.slice(i0, i1), after.slice(j0, j1), alike)
  const pairs = []
  let i = i0
  let j = j0
  for (const [a, b] of [...matches.map(([a, b]) => [a + i0, b + j0]), [i1, j1]]) {
    while (i < a) pairs.push([i++, null])
    while (j < b) pairs.push([null, j++])
    if (a < i1) pairs.push([i++, j++])
  }
  return pairs
}

/** A longest common subsequence, as pairs of indices. */
export function inOrder(before, after, equal) {
  const pairs = []
  let start = 0
  while (start < before.length && start < after.length && equal(before[start], after[start])) pairs.push([start, start++])
  let end = 0
  const rest = Math.min(before.length, after.length) - start
  while (end < rest && equal(before.at(-1 - end), after.at(-1 - end))) end++
  const first = before.slice(start, before.length - end)
  const second = after.slice(start, after.length - end)
  const middle = first.length * second.length > LARGEST ? [] : longest(first, second, equal)
  pairs.push(...middle.map(([i, j]) => [i + start, j + start]))
  for (let k = end; k > 0; k--) pairs.push([before.length - k, after.length - k])
  return pairs
}

function longest(first, second, equal) {
  const width = second.length + 1
  const lengths = new Uint32Array((first.length + 1) * width)
  const matches = new Uint8Array(first.length * second.length)
  for (let i = first.length - 1; i >= 0; i--) {
    for (let j = second.length - 1; j >= 0; j--) {
      const match = equal(first[i], second[j])
      matches[i * second.length + j] = match ? 1 : 0
      const index = i * width + j
      lengths[index] = match ? lengths[index + width + 1] + 1 : Math.max(lengths[index + width], lengths[index + 1])
    }
  }
  const pairs = []
  let i = 0
  let j = 0
  while (i < first.length && j < second.length) {
    const index = i * width + j
    if (matches[i * second.length + j]) pairs.push([i++, j++])
    else if (lengths[index + width] >= lengths[index + 1]) i++
    else j++
  }
  return pairs
}
