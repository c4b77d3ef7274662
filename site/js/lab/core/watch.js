/**
 * Watching for divergence.
 *
 * MuJoCo answers a bad state (a value that is not finite, or beyond 1e10) with a reset and a counter. The lab switches the
 * reset off, and checks after each step: the counters, the time, and the state itself, which MuJoCo would only
 * check at the next step. If the author has switched the reset on again, the counter still shows it.
 */

import { StepNumbers } from './structs.js'

const LARGEST = 1e10 // mjMAXVAL

/** @typedef {{time: number, kind: string, message: string}} Finding */

export class Watch {
  /** @param {import('./engine.js').Engine} engine; @param {Record<string, any>} model; @param {Record<string, any>} data */
  constructor(engine, model, data) {
    this.engine = engine
    this.model = model
    this.data = data
    this.numbers = new StepNumbers(data, model.opt)
    this.counts = new Int32Array(this.numbers.count)
    this.total = 0
    this.arrays = {}
    const { warning } = engine.k
    this.names = Object.fromEntries(Object.entries(warning).map(([name, i]) => [i, name.toLowerCase()]))
    this.fatal = new Set([warning.BADQPOS, warning.BADQVEL, warning.BADQACC])
  }

  /** Switch off MuJoCo's own reset of a diverged state. */
  static disableAutoreset(engine, model) {
    model.opt.disableflags |= engine.k.disable.AUTORESET
  }

  /** Start anew: after a reset, or after lab code that may have repaired the state. */
  restart() {
    for (let i = 0; i < this.counts.length; i++) this.counts[i] = this.numbers.number(i)
    this.total = this.numbers.total()
  }

  /**
   * Check the state after a step from the time `before` to `time` (s).
   *
   * @returns {{diverged: Finding | null, warnings: Finding[]} | null} null when all is well
   */
  look(before, time) {
    if (this.numbers.total() === this.total && time > before && this.isBounded('qpos') && this.isBounded('qvel')) return null
    const warnings = this.takeNew(time)
    const fatal = warnings.find((finding) => finding.fatal)
    return {
      diverged: fatal ?? this.badTime(before, time) ?? this.badState('qpos', time) ?? this.badState('qvel', time),
      warnings: warnings.filter((finding) => !finding.fatal),
    }
  }

  /** The warnings raised since the last call. */
  takeNew(time) {
    const findings = []
    for (let i = 0; i < this.counts.length; i++) {
      const number = this.numbers.number(i)
      if (number > this.counts[i]) {
        const message = sentence(this.engine.mj.mju_warningText(i, this.numbers.info(i)))
        findings.push({ time, kind: this.names[i], message, fatal: this.fatal.has(i) })
      }
      this.counts[i] = number
    }
    this.total = this.numbers.total()
    return findings
  }

  badTime(before, time) {
    if (time > before) return null
    return { time: before, kind: 'time', message: `the time went from ${before} s to ${time} s in a step`, fatal: true }
  }

  badState(name, time) {
    if (this.isBounded(name)) return null
    const index = this.array(name).findIndex((x) => !(Math.abs(x) < LARGEST))
    return { time, kind: `bad${name}`, message: `${name}[${index}] is ${this.array(name)[index]}`, fatal: true }
  }

  isBounded(name) {
    const array = this.array(name)
    for (let i = 0; i < array.length; i++) if (!(Math.abs(array[i]) < LARGEST)) return false
    return true
  }

  array(name) {
    const array = this.arrays[name]
    if (array !== undefined && array.length > 0) return array
    return (this.arrays[name] = this.data[name])
  }
}

/** MuJoCo's text in the style of our own messages. */
function sentence(text) {
  return text.trim().replace(/\.$/, '').replace(/^[A-Z](?=[a-z])/, (letter) => letter.toLowerCase())
}
