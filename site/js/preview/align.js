/**
 * Which items of one list are which of another: what stayed, what changed, what went and what came.
 *
 *   align(before, after, same, alike) → [[i, j], …]
 *
 * In order; `i` or `j` is null for what came or went. Items that are the same are paired first, as many as can be without crossing;
 * between them, items that are alike.
 */

const LARGEST = 250_000 // pairs that are looked at; beyond, only what is alike from the start is paired

export function align(before, after, same, alike) {
  const pairs = []
  let last = [0, 0]
  for (const [i, j] of [...inOrder(before, after, same), [before.length, after.length]]) {
    pairs.push(...between(before, after, last, [i, j], alike))
    if (i < before.length) pairs.push([i, j])
    last = [i + 1, j + 1]
  }
  return pairs
}

/** What lies between two pairs: alike items are paired, the rest went or came. */
function between(before, after, [i0, j0], [i1, j1], alike) {
  const found = inOrder(before.slice(i0, i1), after.slice(j0, j1), alike)
  const pairs = []
  let i = i0
  let j = j0
  for (const [a, b] of [...found.map(([a, b]) => [a + i0, b + j0]), [i1, j1]]) {
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
  const one = before.slice(start, before.length - end)
  const two = after.slice(start, after.length - end)
  const middle = one.length * two.length > LARGEST ? [] : longest(one, two, equal)
  pairs.push(...middle.map(([i, j]) => [i + start, j + start]))
  for (let k = end; k > 0; k--) pairs.push([before.length - k, after.length - k])
  return pairs
}

function longest(one, two, equal) {
  const width = two.length + 1
  const lengths = new Uint32Array((one.length + 1) * width)
  const matches = new Uint8Array(one.length * two.length)
  for (let i = one.length - 1; i >= 0; i--) {
    for (let j = two.length - 1; j >= 0; j--) {
      const match = equal(one[i], two[j])
      matches[i * two.length + j] = match ? 1 : 0
      const at = i * width + j
      lengths[at] = match ? lengths[at + width + 1] + 1 : Math.max(lengths[at + width], lengths[at + 1])
    }
  }
  const pairs = []
  let i = 0
  let j = 0
  while (i < one.length && j < two.length) {
    const at = i * width + j
    if (matches[i * two.length + j]) pairs.push([i++, j++])
    else if (lengths[at + width] >= lengths[at + 1]) i++
    else j++
  }
  return pairs
}
