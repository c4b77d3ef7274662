/** What a trial's main run leaves for the lab's static form: pictures, samples and readouts. */

import { LabError } from '../core/piece.js'

const POINTS = 1000 // of a recorded trace, at most
const INFINITE = new Map([[Infinity, '∞'], [-Infinity, '−∞']])

/** The moment: {time, frame, readouts}; readouts that fail are told elsewhere, and make them `null`. JSON has no infinity. */
export function picture(lab) {
  let readouts = null
  try {
    if (lab.diverged === null) readouts = lab.readouts().map((value) => INFINITE.get(value) ?? value)
  } catch (error) {
    if (!(error instanceof LabError) || error.kind === 'engine') throw error
  }
  return { time: lab.time, frame: lab.frame(null).slice(), readouts }
}

/** The samples since the lab's start, thinned: {times, plots: [[values of each trace]]}. */
export function record(lab) {
  const { times, values } = lab.sampler.take()
  const width = lab.sampler.traces.length
  const stride = Math.max(1, Math.ceil(times.length / POINTS))
  const picked = Array.from({ length: Math.ceil(times.length / stride) }, (_, i) => i * stride)
  let column = 0
  const plots = lab.code.plots.map((traces) =>
    traces.map(() => {
      const at = column++
      return picked.map((i) => values[i * width + at])
    }),
  )
  return { times: picked.map((i) => times[i]), plots }
}

/** The scene with textures as coarse as a picture of a few hundred pixels needs them. */
export function withSmallTextures(scene) {
  return { ...scene, textures: scene.textures.map(small) }
}

const FLAT = 0 // mjtTexture
const WIDEST = 256 // texels of a flat texture
const WIDEST_FACE = 64 // of a face of a cube

function small(texture) {
  const { type, width, height, channels, data } = texture
  const faces = type !== FLAT && height === 6 * width ? 6 : 1
  const most = type === FLAT ? WIDEST : WIDEST_FACE
  const w = Math.min(width, most)
  const h = faces * Math.min(height / faces, most)
  if (w === width && h === height) return texture
  return { ...texture, width: w, height: h, data: thinned(data, [width, height], [w, h], channels) }
}

/** Rows of texels, each the mean of those that it takes the place of. */
function thinned(data, [width, height], [w, h], channels) {
  const target = new Uint8Array(w * h * channels)
  for (let j = 0, to = 0; j < h; j++) {
    const [top, bottom] = [j, j + 1].map((k) => Math.floor((k * height) / h))
    for (let i = 0; i < w; i++) {
      const [left, right] = [i, i + 1].map((k) => Math.floor((k * width) / w))
      for (let c = 0; c < channels; c++, to++) {
        let sum = 0
        for (let y = top; y < bottom; y++) for (let x = left; x < right; x++) sum += data[(y * width + x) * channels + c]
        target[to] = Math.round(sum / ((bottom - top) * (right - left)))
      }
    }
  }
  return target
}
