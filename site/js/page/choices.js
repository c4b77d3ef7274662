/** What the reader chose, stored in this browser. */

/** The browser's storage; `null` if it is blocked. */
export function openStorage() {
  try {
    return globalThis.localStorage ?? null
  } catch {
    return null
  }
}

/** A stored choice; `null` if there is none, or storage is blocked. */
export function readChoice(key, storage = openStorage()) {
  try {
    return storage?.getItem(key) ?? null
  } catch {
    return null
  }
}

/** Store a choice; with `null`, forget it. Where storage is blocked or full, it holds for this page. */
export function writeChoice(key, choice, storage = openStorage()) {
  try {
    if (choice === null) storage.removeItem(key)
    else storage.setItem(key, choice)
  } catch {
    // Nothing is stored.
  }
}
