/**
 * Records what native MuJoCo needs to repeat a run of a lab, and the states that it has to arrive at.
 *
 * These are the model with the lab's changes, the state at the start, and every number of the state that the lab's controller
 * wrote, with the number of the step that followed. Of each step there is a CRC-32 of the positions, velocities and activations,
 * and of every `stride`-th step the numbers themselves.
 */

import { packed } from './record.js'

const MOST_NUMBERS = 200_000 // of recorded states
const MOST_WRITES = 1_000_000

export class ParityRecorder {
  /**
   * @param {import('../core/lab.js').Lab} lab
   * @param {Uint8Array} sent the model that the lab was made from
   * @param {number} steps the most that will be recorded
   */
  constructor(lab, sent, steps) {
    this.lab = lab
    this.stateBefore = null
    this.mjb = saveModel(lab)
    this.autoreset = (lab.option.disableflags & lab.engine.k.disable.AUTORESET) === 0
    this.asSent = equalBytes(this.mjb, sent) || equalBytes(saveWithReset(lab), sent)
    this.start = lab.physics.read()
    this.width = lab.model.nq + lab.model.nv + lab.model.na
    this.stride = Math.max(1, Math.ceil((steps * this.width) / MOST_NUMBERS))
    this.rows = []
    this.sums = []
    this.writes = { steps: [], indices: [], values: [] }
    this.complete = true
  }

  /** Before the controller. */
  begin() {
    if (this.lab.code.controller) this.stateBefore = this.lab.physics.read()
  }

  /** Between the controller and the step. */
  controlled() {
    if (this.stateBefore === null || !this.complete) return
    const { writes } = this
    const state = this.lab.physics.read()
    const [old, now] = [bits(this.stateBefore), bits(state)]
    for (let i = 0; i < state.length; i++) {
      if (old[2 * i] === now[2 * i] && old[2 * i + 1] === now[2 * i + 1]) continue
      writes.steps.push(this.sums.length)
      writes.indices.push(i)
      writes.values.push(state[i])
    }
    if (writes.steps.length > MOST_WRITES) this.complete = false
  }

  /** After the step. */
  end() {
    const { qpos, qvel, act } = this.lab.data
    this.sums.push(crc32(act, crc32(qvel, crc32(qpos, 0))))
    if (this.sums.length % this.stride === 0) this.rows.push(...qpos, ...qvel, ...act)
  }

  /** The record. `mjb` is null if the lab has changed nothing of the model except `autoreset`, whether MuJoCo resets a diverged state. */
  result() {
    const { writes } = this
    return packed({
      mjb: this.asSent ? null : this.mjb,
      autoreset: this.autoreset,
      modelChanged: !equalBytes(this.mjb, saveModel(this.lab)),
      complete: this.complete,
      signature: this.lab.physics.signature,
      start: this.start,
      steps: this.sums.length,
      stride: this.stride,
      width: this.width,
      states: Float64Array.from(this.rows),
      checksums: Uint32Array.from(this.sums),
      writes: {
        steps: Int32Array.from(writes.steps),
        indices: Int32Array.from(writes.indices),
        values: Float64Array.from(writes.values),
      },
    })
  }
}

/** The model as an MJB file. */
export function saveModel({ engine, model }) {
  const { mj } = engine
  const buffer = new mj.Uint8Buffer(Number(mj.mj_sizeModel(model)))
  try {
    mj.mj_saveModel(model, null, buffer)
    return buffer.GetView().slice()
  } finally {
    buffer.delete()
  }
}

/** The model as an MJB file with MuJoCo's autoreset switched on, which every lab switches off. */
function saveWithReset(lab) {
  const { option } = lab
  const flags = option.disableflags
  option.disableflags = flags & ~lab.engine.k.disable.AUTORESET
  const bytes = saveModel(lab)
  option.disableflags = flags
  return bytes
}

const bits = (view) => new Int32Array(view.buffer, view.byteOffset, 2 * view.length)

function equalBytes(a, b) {
  return a.length === b.length && a.every((byte, i) => byte === b[i])
}

const TABLE = Uint32Array.from({ length: 256 }, (_, i) => {
  let c = i
  for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1
  return c
})

/** The CRC-32 of zlib, continued from `start`, over the bytes of an array. */
export function crc32(view, start) {
  const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength)
  let c = ~start
  for (let i = 0; i < bytes.length; i++) c = TABLE[(c ^ bytes[i]) & 255] ^ (c >>> 8)
  return ~c >>> 0
}
