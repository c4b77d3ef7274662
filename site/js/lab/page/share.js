/**
 * A state of a lab in the fragment of a link: `#lab=ID&s=TEXT`.
 *
 * TEXT is base64url of JSON: `v` the values of the controls, `n` the steps since the reset, `t` the time (s), and `p` the whole
 * physics as base64 of 64-bit floats, where that is short enough for a link. Without `p` a link holds the controls only.
 */

const LONGEST = 240 // numbers: a link of about 2.5 kB

/** @param {string} id @param {{values: unknown[], steps: number, time: number, physics: Float64Array}} state */
export function writeLink(id, { values, steps, time, physics }) {
  const content = { v: values, n: steps, t: time }
  if (physics.length <= LONGEST) content.p = toBase64(new Uint8Array(physics.slice().buffer))
  const text = toBase64(new TextEncoder().encode(JSON.stringify(content)))
  return `#lab=${encodeURIComponent(id)}&s=${text.replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '')}`
}

/**
 * Read a fragment; null if it is not of a lab or cannot be read.
 *
 * @param {string} fragment
 * @returns {{id: string, state: {values: unknown[], steps: number, time: number, physics: Float64Array | null} | null} | null}
 */
export function readLink(fragment) {
  if (!fragment.startsWith('#lab=')) return null
  const fields = new URLSearchParams(fragment.slice(1))
  const id = fields.get('lab')
  const text = fields.get('s')
  if (!text) return { id, state: null }
  try {
    const bytes = fromBase64(text.replaceAll('-', '+').replaceAll('_', '/'))
    const { v, n, t, p } = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(bytes))
    if (!Array.isArray(v)) return { id, state: null }
    const physics = typeof p === 'string' ? new Float64Array(fromBase64(p).buffer) : null
    return { id, state: { values: v, steps: Number.isInteger(n) && n >= 0 ? n : 0, time: Number(t) || 0, physics } }
  } catch {
    return { id, state: null }
  }
}

function toBase64(bytes) {
  let text = ''
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096))
  return btoa(text)
}

function fromBase64(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0))
}
