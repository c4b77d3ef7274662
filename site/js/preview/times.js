/** How long scripts still run, told by the time that they took the last time. */

const LONG = 1 // s: less is not worth saying

let offset = 0 // s, from this clock to the server's

/** Set the server's clock, by its seconds since 1970. */
export function setClock(now) {
  offset = now - Date.now() / 1000
}

/** The seconds that a script took the last time, and those that are left, perhaps none; nothing if that is not known. */
export function timesOf({ began, last }) {
  if (last === null || last < LONG) return null
  return { last: Math.round(last), left: Math.max(0, Math.round(last - (Date.now() / 1000 + offset - began))) }
}
