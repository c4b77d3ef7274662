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
    this.restart()
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
    this.counts = this.numbers.counts()
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
    const { counts: before, numbers, engine } = this
    this.restart()
    const raised = Object.keys(this.names).map(Number).filter((i) => this.counts[i] > before[i])
    const message = (i) => sentence(engine.mj.mju_warningText(i, numbers.info(i)))
    return raised.map((i) => ({ time, kind: this.names[i], message: message(i), fatal: this.fatal.has(i) }))
  }

  badTime(before, time) {
    if (time > before) return null
    return { time: before, kind: 'time', message: `the time went from ${before} s to ${time} s in a step`, fatal: true }
  }

  badState(name, time) {
    const array = this.array(name)
    const index = array.findIndex((x) => !(Math.abs(x) < LARGEST))
    return index < 0 ? null : { time, kind: `bad${name}`, message: `${name}[${index}] is ${array[index]}`, fatal: true }
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
