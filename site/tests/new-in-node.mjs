/** What browsers and the V8 of trials have, and older versions of Node do not. */

Uint8Array.prototype.toBase64 ??= function () {
  return Buffer.from(this).toString('base64')
}

Map.groupBy ??= (items, keyOf) => {
  const groups = new Map()
  for (const item of items) groups.set(keyOf(item), [...(groups.get(keyOf(item)) ?? []), item])
  return groups
}
