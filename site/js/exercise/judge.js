/**
 * Judges an attempt at an exercise, in the same way in the page's worker and in the build.
 *
 * Each trial has a simulation of its own, from the start: its button is pressed, steps are made until its time, and its expression, which
 * is the readout of the same number, is compared with its bounds. An attempt that changes what the trial computes with, such as `Math.abs`,
 * fails it, and the change is undone before the next one.
 */

import { Lab } from '../lab/core/lab.js'
import { call, numeric } from '../lab/core/piece.js'
import { attemptCode } from './attempt.js'

const SLICE = 64 // steps between two beats
const MOST = 200_000 // steps of a trial

/**
 * @typedef {{passed: boolean, seen: number | null, failure: string}} Verdict `seen`: the value, or `null` if there is none; `failure`: why,
 *   or why the run ended before its time
 */

/**
 * @param {import('../lab/core/engine.js').Engine} engine
 * @param {Record<string, any>} config the lab's data, with `exercise` and `attempt`
 * @param {Record<string, any>} code the lab's functions
 * @param {Uint8Array | null} bytes the model, unless the attempt is one
 * @param {import('../lab/trial/guard.js').Guard} guard of what the judge and its trials share with the attempt
 * @param {() => void} [beat] called as it makes progress
 * @returns {Generator<Verdict>} one for each trial
 * @throws {Error} nothing can be tried
 */
export function* judge(engine, config, code, bytes, guard, beat = () => {}) {
  const source = config.exercise.subject === 'model' ? config.attempt : bytes
  const attempt = attemptCode(config, code)
  engine.load(source).dispose() // a model that does not compile is no matter of a trial
  for (const [i, trial] of config.exercise.trials.entries()) {
    const verdict = tryOnce(() => new Lab(engine, source, config, attempt), attempt.readouts[i], ['readouts', i, 'expr'], trial, beat)
    const changes = guard.changes()
    guard.repair()
    yield changes.length === 0 ? verdict : { passed: false, seen: null, failure: `${changes.join(', ')} must stay as it was` }
  }
}

/** @returns {Verdict} */
function tryOnce(open, read, entry, trial, beat) {
  let lab = null
  try {
    lab = open()
    lab.start()
    if (trial.button !== null) lab.press(trial.button)
    advance(lab, trial.t, beat)
    if (lab.diverged !== null) return { passed: false, seen: null, failure: lab.diverged.message }
    const seen = call(entry, () => numeric(entry, read(lab.sync())))
    if (!Number.isFinite(seen)) return { passed: false, seen: null, failure: `the value is ${seen}` }
    const passed = seen >= (trial.min ?? -Infinity) && seen <= (trial.max ?? Infinity)
    return { passed, seen, failure: '' }
  } catch (error) {
    if (error.fatal || error.kind === 'engine' || error instanceof WebAssembly.RuntimeError) throw error
    return { passed: false, seen: null, failure: error.message ?? String(error) }
  } finally {
    lab?.dispose()
  }
}

function advance(lab, t, beat) {
  for (let made = 0; lab.diverged === null; ) {
    const due = Math.round((t - lab.time) / lab.option.timestep)
    if (!(due > 0)) return
    if (made >= MOST) throw new Error(`${MOST} steps do not reach t = ${t} s`)
    const { steps } = lab.step(Math.min(due, SLICE))
    made += Math.max(1, steps)
    beat()
  }
}
