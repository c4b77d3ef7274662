/**
 * A state of a lab, and the motion that led to it, in the fragment of a link: `#lab=ID&z=TEXT`.
 *
 * TEXT is base64url of a deflated content: JSON on one line (`v` the values of the controls, `n` the steps since the reset, `t` the
 * time in s; `l` the log: the values of the controls at the reset, and the events since), and after the end of the line the whole
 * physics as 64-bit floats. If all this is too long for a link, the log is left out, then the physics. A model that the reader has
 * written is in the JSON, as `x`, with `o` if it did not begin as the lab's.
 */

import { copyText } from '../../page/copy.js'

/** The most characters of a link: all browsers keep so many in an address, and most programs that pass it on. */
export const LONGEST = 16_000

/** The most characters of a model. */
export const LONGEST_MODEL = 100_000

const MOST_EVENTS = 10_000 // of a log
const LARGEST = 8 << 20 // bytes that a link may inflate to
const LINE_END = 10

/**
 * @param {string} id
 * @param {{values: unknown[], steps: number, time: number, physics: Float64Array, text?: string, isOther?: boolean, log?: Record<string, any> | null}} state
 * @returns {Promise<{link: string, only: 'state' | 'controls' | null}>} `only`: what it holds if not all fitted
 */
export async function writeLink(id, { values, steps, time, physics, text, isOther, log = null }) {
  const state = { v: values, n: steps, t: time, x: text, o: isOther || undefined }
  const motion = log && steps > 0 ? { ...state, l: [log.values, log.events] } : state
  const link = (text) => `#lab=${encodeURIComponent(id)}&${text}`
  /** @type {[Record<string, any>, 'state' | null][]} */
  const forms = [[motion, null], [state, motion === state ? null : 'state']]
  for (const [head, only] of forms) {
    const whole = await field(head, physics)
    if (whole.length <= LONGEST) return { link: link(whole), only }
  }
  return { link: link(await field(state, [])), only: 'controls' }
}

/** Put a link into the address bar and, if allowed, the clipboard; returns the key of the message. */
export async function copyLink(link) {
  const address = new URL(window.location.href)
  address.hash = link
  window.history.replaceState(null, '', address)
  return (await copyText(address.href)) ? 'lab.live.link_copied' : 'lab.live.link_shown'
}

async function field(head, physics) {
  const content = new Blob([`${JSON.stringify(head)}\n`, Float64Array.from(physics)])
  const bytes = /** @type {any} */ (await pipe(content, new CompressionStream('deflate-raw')))
  return `z=${bytes.toBase64({ alphabet: 'base64url', omitPadding: true })}`
}

/**
 * Read a fragment; null if it is not of a lab; without `state` if that cannot be read.
 *
 * @param {string} fragment
 * @returns {Promise<{id: string, state: null | {values: unknown[], steps: number, time: number, physics: Float64Array | null,
 *   text?: string, isOther?: boolean, log?: {values: unknown[], events: unknown[][], end: number}}} | null>}
 */
export async function readLink(fragment) {
  if (!fragment.startsWith('#lab=')) return null
  const fields = new URLSearchParams(fragment.slice(1))
  const id = fields.get('lab')
  try {
    const bytes = /** @type {any} */ (Uint8Array).fromBase64(fields.get('z'), { alphabet: 'base64url' })
    return { id, state: parse(await pipe(bytes, new DecompressionStream('deflate-raw'))) }
  } catch {
    return { id, state: null }
  }
}

function parse(bytes) {
  const end = bytes.includes(LINE_END) ? bytes.indexOf(LINE_END) : bytes.length
  const { v, n, t, x, o, l } = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(bytes.subarray(0, end)))
  if (!Array.isArray(v)) return null
  const floats = bytes.slice(end + 1)
  const physics = floats.length > 0 ? new Float64Array(floats.buffer) : null
  const state = { values: v, steps: Number.isInteger(n) && n >= 0 ? n : 0, time: Number(t) || 0, physics }
  if (isLog(l)) state.log = { values: l[0], events: l[1], end: state.time }
  return typeof x === 'string' && x.length <= LONGEST_MODEL ? { ...state, text: x, isOther: o === true } : state
}

/** A log as the JSON that an author gives a goal: one line for each event. */
export function writeLog({ values, events }, controls) {
  const initialEntries = values.flatMap((value, i) => (value === (controls[i].value ?? null) ? [] : [[0, i, value]]))
  const entries = [...initialEntries, ...events].map(([t, i, value]) => {
    const { label } = controls[i]
    return JSON.stringify({ t, do: value === undefined ? label : { [label]: value } })
  })
  return `"log": [${entries.join(',\n  ')}]`
}

/** Whether a value has the form of a log; whether its controls exist and accept its values is checked by the lab. */
function isLog(value) {
  if (!Array.isArray(value) || !value.slice(0, 2).every(Array.isArray) || value.length !== 2) return false
  const isValue = (item) => typeof item === 'string' || Number.isFinite(item)
  /** @type {(event: any) => boolean} */
  const isEvent = ([time, control, ...rest]) => time >= 0 && Number.isFinite(time) && Number.isInteger(control) && rest.length <= 1 && rest.every(isValue)
  return value[1].length <= MOST_EVENTS && value[0].every((item) => item === null || isValue(item)) && value[1].every((event) => Array.isArray(event) && isEvent(event))
}

/** Deflate or inflate by a stream, to at most so many bytes. @param {BlobPart} bytes */
export async function pipe(bytes, stream, most = LARGEST, tooMuch = new RangeError('the link unfolds to too much')) {
  const chunks = []
  let size = 0
  const reader = new Blob([bytes]).stream().pipeThrough(stream).getReader()
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    chunks.push(part.value)
    size += part.value.length
    if (size > most) {
      await reader.cancel()
      throw tooMuch
    }
  }
  return new Uint8Array(await new Blob(chunks).arrayBuffer())
}
