/** FNV-1a of a text in UTF-8, 32 bits (G. Fowler, L. Noll, K. Vo). */
export function hashOf(text) {
  let value = 0x811c9dc5
  for (const byte of new TextEncoder().encode(text)) value = Math.imul(value ^ byte, 0x01000193) >>> 0
  return value
}
