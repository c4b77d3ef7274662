/** Records a trial's main run for the lab's static form: pictures, samples and readouts. */

import { resize } from '../core/detail.js'
import { nameOf } from '../core/names.js'
import { LabError } from '../core/piece.js'

const KINDS = { Float32Array: 'f32', Float64Array: 'f64', Int32Array: 'i32', Uint8Array: 'u8', Uint32Array: 'u32' }

/** A value for JSON: arrays of numbers in it become {type: 'f32' | 'f64' | 'i32' | 'u32' | 'u8', data: base64}. */
export function packed(value) {
  if (ArrayBuffer.isView(value)) {
    const bytes = /** @type {any} */ (new Uint8Array(value.buffer, value.byteOffset, value.byteLength))
    return { type: KINDS[value.constructor.name], data: bytes.toBase64() } // which V8 has
  }
  if (Array.isArray(value)) return value.map(packed)
  if (value === null || typeof value !== 'object') return value
  return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, packed(item)]))
}

const POINTS = 1000 // of a recorded trace, at most
const INFINITE = new Map([[Infinity, '∞'], [-Infinity, '−∞']])

/** The present moment: {time, frame, readouts}; `readouts` is null if one fails, which `Trial` reports. JSON has no infinity, so it becomes a text. */
export function picture(lab) {
  let readouts = null
  try {
    if (lab.diverged === null) readouts = lab.readouts().map((value) => INFINITE.get(value) ?? value)
  } catch (error) {
    if (!(error instanceof LabError) || error.kind === 'engine') throw error
  }
  return { time: lab.time, frame: lab.frame(null).slice(), readouts }
}

const FILM_RATE = 10 // pictures of a film in a second; schema.py has the same

/** What is seen in the first seconds after Play, if a film is asked for. */
export function film(trial, { arrows }) {
  const { film: seconds, start, controls } = trial.config
  if (!seconds) return []
  return trial.fresh({ ...trial.config, arrows }, (lab) => {
    if (start) lab.press(controls.findIndex(({ label }) => label === start))
    const [frames, begin] = [[lab.frame(null).slice()], lab.time]
    const advance = (i) => trial.advance(lab, begin + i / FILM_RATE, Infinity, ['stopAt', 'code'])
    for (let i = 1; i < Math.round(seconds * FILM_RATE) && advance(i) === null; i++) frames.push(lab.frame(null).slice())
    return frames
  })
}

/** The bodies that have fallen out of the scene; `heights`: of their tops, m, by body. */
export function fallenBodies(lab, engine, heights) {
  const name = (body) => nameOf(engine, lab.model, engine.k.obj.BODY, body) || `body ${body}`
  return [...heights].map(([body, height]) => ({ name: name(body), height, time: lab.time }))
}

/** Widen the least and the greatest value of each trace, `[low, high]`, by the samples of a run. */
export function widen(reach, { traces, values }) {
  traces.forEach((_, j) => {
    for (let i = j; i < values.length; i += traces.length) {
      const [low, high] = reach[j] ?? [values[i], values[i]]
      if (Number.isFinite(values[i])) reach[j] = [Math.min(low, values[i]), Math.max(high, values[i])]
    }
  })
}

/** The samples since the lab's start, at most POINTS of them: {times, plots: [[values of each trace]]}. */
export function record(lab) {
  const { times, values } = lab.sampler.take()
  const width = lab.sampler.traces.length
  const stride = Math.max(1, Math.ceil(times.length / POINTS))
  const indices = Array.from({ length: Math.ceil(times.length / stride) }, (_, i) => i * stride)
  let column = 0
  const plots = lab.code.plots.map((traces) =>
    traces.map(() => {
      const index = column++
      return indices.map((i) => values[i * width + index])
    }),
  )
  return { times: indices.map((i) => times[i]), plots }
}

const FLAT = 0 // mjtTexture
const WIDEST = 256 // texels of a flat texture
const WIDEST_FACE = 64 // of a face of a cube

/** The scene with its textures reduced to what a picture of a few hundred pixels needs. */
export function withSmallTextures(scene) {
  const widest = ({ type }) => (type === FLAT ? WIDEST : WIDEST_FACE)
  return { ...scene, textures: scene.textures.map((texture) => resize(texture, (side) => Math.min(side, widest(texture)))) }
}
