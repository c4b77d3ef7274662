/** What browsers and the V8 of trials have, and older versions of Node do not. */

Uint8Array.prototype.toBase64 ??= function ({ alphabet = 'base64' } = {}) {
  return Buffer.from(this).toString(alphabet)
}

Uint8Array.fromBase64 ??= (text, { alphabet = 'base64' } = {}) => new Uint8Array(Buffer.from(text, alphabet))

Map.groupBy ??= (items, keyOf) => {
  const groups = new Map()
  for (const item of items) groups.set(keyOf(item), [...(groups.get(keyOf(item)) ?? []), item])
  return groups
}
