/** Bytes as base64 text and back, with V8's own functions where it has them. */

const LETTERS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/'
const CHUNK = 0x3000 // bytes at a time, a multiple of 3

/** @param {ArrayBufferView} view */
export function toBase64(view) {
  const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength)
  if (typeof bytes.toBase64 === 'function') return bytes.toBase64()
  const parts = []
  for (let start = 0; start < bytes.length; start += CHUNK) parts.push(encode(bytes.subarray(start, start + CHUNK)))
  return parts.join('')
}

function encode(bytes) {
  let text = ''
  for (let i = 0; i < bytes.length; i += 3) {
    const word = (bytes[i] << 16) | ((bytes[i + 1] ?? 0) << 8) | (bytes[i + 2] ?? 0)
    const have = bytes.length - i
    text += LETTERS[word >> 18] + LETTERS[(word >> 12) & 63]
    text += have > 1 ? LETTERS[(word >> 6) & 63] : '='
    text += have > 2 ? LETTERS[word & 63] : '='
  }
  return text
}

/** @param {string} text; @returns {Uint8Array} */
export function fromBase64(text) {
  if (typeof Uint8Array.fromBase64 === 'function') return Uint8Array.fromBase64(text)
  const digits = text.replace(/=+$/, '')
  const bytes = new Uint8Array(Math.floor((digits.length * 3) / 4))
  let word = 0
  let length = 0
  for (let i = 0; i < digits.length; i++) {
    word = (word << 6) | LETTERS.indexOf(digits[i])
    if (i % 4 > 0) bytes[length++] = (word >> (6 - 2 * (i % 4))) & 255
  }
  return bytes
}

/** A value for JSON: arrays of numbers in it become {type: 'f32' | 'f64' | 'i32' | 'u8', data: base64}. */
export function packed(value) {
  if (ArrayBuffer.isView(value)) {
    const kinds = { Float32Array: 'f32', Float64Array: 'f64', Int32Array: 'i32', Uint8Array: 'u8', Uint32Array: 'u32' }
    return { type: kinds[value.constructor.name], data: toBase64(value) }
  }
  if (Array.isArray(value)) return value.map(packed)
  if (value === null || typeof value !== 'object') return value
  return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, packed(item)]))
}
