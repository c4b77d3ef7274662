/** What a trial's main run leaves for the lab's static form: pictures, samples and readouts. */

import { LabError } from '../core/piece.js'

const POINTS = 1000 // of a recorded trace, at most

/** The moment: {time, frame, readouts}; readouts that fail are told elsewhere, and make it `null`. */
export function picture(lab) {
  let readouts = null
  try {
    if (lab.diverged === null) readouts = lab.readouts()
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

/** Pictures that are drawn without a GPU show no textures, which can be large. */
export function withoutTextures(scene) {
  return { ...scene, textures: scene.textures.map((texture) => ({ ...texture, data: null })) }
}
