/** Compares texts. */

/** The stretch of `before` to replace, and its replacement: `{start, count, text}`. Surrogate pairs are not split. */
export function difference(before, after) {
  const shortest = Math.min(before.length, after.length)
  let start = 0
  while (start < shortest && before[start] === after[start]) start++
  if (start > 0 && isHigh(before, start - 1)) start--
  let end = 0
  while (end < shortest - start && before[before.length - 1 - end] === after[after.length - 1 - end]) end++
  if (end > 0 && isLow(before, before.length - end)) end--
  return { start, count: before.length - end - start, text: after.slice(start, after.length - end) }
}

const isHigh = (text, index) => (text.charCodeAt(index) & 0xfc00) === 0xd800
const isLow = (text, index) => (text.charCodeAt(index) & 0xfc00) === 0xdc00
