/**
 * A lab's trial: everything that a reader can do with the lab is tried, and each failure is reported with its entry.
 *
 *   runTrial(engine, request, bytes, now) → reply          (both plain values)
 *
 * 1. The main run: from the start, stepping as Play does. It provides the lab's static form and the record for parity.
 *    What Play alone moves is measured in its first 3 s; where Play presses a button (`start`), in a run of its own.
 * 2. Every control at its ends and at its value, every option, every button, each from a fresh start and followed by 0.5 s of steps
 *    (at most 500). Every readout and trace is evaluated before and after.
 * 3. Every claim (`expect`), from a fresh start; claims after the same acts share a run. The acts (`after`, here always a list) are done
 *    at the start, with no time between them. A claim with `diverges` holds if the simulation has diverged by its time.
 * 4. The goal: its log has to reach it, within the main run's length after the last act and the time to hold; doing nothing must not.
 *
 * The same request gives the same reply, but for `stepsPerSecond`. The request:
 *
 *   config   the lab's JSON
 *   code     the lab's functions as one expression
 *   seconds  how long the main run is (`verify.seconds`), or `null`: until `stopAt`, or 5 s; then at most 20 000 steps
 *   parity   whether to record what native MuJoCo needs (`true`)
 *
 * The reply, whose types are in `reply.py` of the feature:
 *
 *   tried           `[{entry, what}]` in order
 *   failures        `[{entry, kind, message, at, during}]`: `at` is a simulated time or `null`, `during` the attempt as in `tried`. The
 *                   kind `nan` is a value that is not finite, unless the lab's own code writes `NaN` or `Infinity`; `type` a value of
 *                   the wrong type; `engine` an engine that ended or does not load the model. Every divergence is a failure here
 *   stepsPerSecond  of the lab with its controller and samples, without recording
 *   main            the main run, or `null` if the lab does not start:
 *
 *     stopped, diverged          `stopAt`, `code` or `null`; whether it diverged
 *     plots                      `{times, plots: [[values of each trace]]}`, at most 1000 times; a gap is `null`
 *     reach                      the least and the greatest value of each trace after Play, `[low, high]`, or `null` if it has none
 *     pictures                   `{time, frame, readouts}` at the start and at the end
 *     scene                      as the page gets it, with textures of at most 256 × 256 and faces of cubes of 64 × 64
 *     film                       what is seen in the first `film` seconds after Play, ten times a second; without `film`, nothing
 *     fill                       the part of the picture that the motion fills which Play gives
 *     moved                      the part of it in which something is seen to move within 3 s after Play
 *     arrows                     metres for each unit of momentum, angular momentum and force: the middle arrow seen is 0.3 of the
 *                                picture's height
 *     parity                     what native MuJoCo needs (parity.js)
 *     resetDiffers               `null` or `{what, entry}`: the first number of the state that a reset does not restore, such as
 *                                `qvel[0]`, and the entry that would have to set it (`[]`: unknown). The solver's warm start may differ
 *
 * Arrays of numbers are `{type, data}` with `f32`, `f64`, `i32`, `u32` or `u8` and little-endian base64.
 */

import { EngineError } from '../core/engine.js'
import { ArrowScales } from '../core/arrows.js'
import { OVERLAYS } from '../core/frame.js'
import { Lab } from '../core/lab.js'
import { LabError, call, current, curveEntry, numeric, plottable, readable } from '../core/piece.js'
import { Framing } from '../core/framing.js'
import { act, controlActs, describe } from './acts.js'
import { deepContact } from './deep.js'
import { Motion } from './motion.js'
import { ParityRecorder } from './parity.js'
import { fallenBodies, film, packed, picture, record, widen, withSmallTextures } from './record.js'
import { resetDiffers } from './reset.js'

const SECONDS = 5 // of simulated time, unless the lab says otherwise
const STEPS = 20_000 // at most, unless the lab says for how long
const PROBE = { seconds: 0.5, steps: 500 } // after each act
const PACE = 2000 // steps, at most
const SLICE = 64 // steps at a time
const CHECKS = 100 // looks at the readouts during the main run

/** Ends the trial: the failure has been reported, and the engine cannot be trusted any more. */
class Ended extends Error {}

/** When the trial began, and when it last made progress; still known after the trial was stopped from outside. */
const progress = { start: 0, last: 0 }

/** The entry whose code may never return: it has run for more than a twentieth of the trial's time; else null. */
export function stuckEntry(now) {
  return now - progress.last > (now - progress.start) / 20 ? current.entry : null
}

/** @param {import('./guard.js').Guard | null} guard of what labs share */
export function runTrial(engine, request, bytes, now, guard = null) {
  return new Trial(engine, request, request.config.xml ?? bytes, now, guard).run()
}

const rounded = (time) => Number(time.toFixed(3))

class Trial {
  constructor(engine, { config, code, seconds = null, parity = true }, bytes, now, guard) {
    this.engine = engine
    this.guard = guard
    this.config = config
    this.bytes = bytes
    this.now = now
    progress.start = progress.last = now()
    this.seconds = seconds
    this.parity = parity
    this.attempts = []
    this.failures = []
    this.reportedKeys = new Set()
    this.code = null
    this.text = code
    // A value that is not finite is a mistake, unless the lab's code contains it literally.
    this.isIntended = (value) => new RegExp(`\\b${Math.abs(value)}\\b`).test(code)
    this.steps = 0
    this.took = 0
    this.framing = null
    this.motion = null // while it is measured
    this.playedMotion = null
    this.reach = [] // of each trace
    this.arrowScales = new ArrowScales()
  }

  run() {
    const reply = { version: this.engine.version, main: null }
    try {
      this.code = call([], () => new Function(`"use strict"; return ${this.text}`)())
      reply.main = this.attempt([], 'start', (lab) => this.mainRun(lab))
      if (reply.main !== null) this.start()
      for (const { entry, what: title, act: change } of controlActs(this.config.controls)) {
        this.attempt(entry, title, (lab) => {
          change(lab)
          this.probe(lab)
        })
      }
      this.claims()
      this.goal()
      if (reply.main !== null) this.frame(reply.main)
      if (reply.main !== null) reply.main.film = packed(film(this, reply.main))
      // last: whether a short run took a millisecond of the clock may change nothing that is published
      if (reply.main !== null && this.took === 0) this.pace(reply.main)
    } catch (error) {
      if (!(error instanceof Ended)) this.fail([], 'engine', String(error.message ?? error), null)
    }
    const { attempts: tried, failures, steps, took } = this
    return { ...reply, tried, failures, stepsPerSecond: took > 0 ? Math.round(steps / took) : null }
  }

  /** Press the button that Play presses, where there is one, and follow what it moves. */
  start() {
    const { start, controls, stopAt } = this.config
    if (!start) return
    this.attempt(['start'], 'Play', (lab) => {
      this.framing.played = this.framing.runs.length - 1
      this.motion = new Motion(lab)
      this.observe(lab)
      lab.press(controls.findIndex(({ label }) => label === start))
      this.advance(lab, Math.min(stopAt ?? Infinity, lab.time + SECONDS))
      this.endMotion(lab)
    })
  }

  endMotion(lab) {
    this.playedMotion = this.motion
    this.motion = null
    widen(this.reach, lab.sampler)
  }

  /** Measure the speed of a lab of which only the recorded run was tried: run it once more, without recording. */
  pace({ steps }) {
    this.fresh(this.config, (lab) => this.advance(lab, Infinity, Math.min(steps, PACE), ['stopAt', 'code']))
  }

  /** Place the camera so that it shows all of the motion, unless the lab places it. */
  frame(main) {
    const { camera } = main.scene
    const fitting = camera.orthographic ? null : this.framing.fit()
    if (fitting === null) return
    if (this.config.camera?.distance == null && this.config.camera?.target == null) Object.assign(camera, fitting)
    main.scene.floor = this.framing.floor()
    main.fill = this.framing.fill(camera)
    main.moved = this.playedMotion.share(camera)
    main.arrows = this.arrowScales.fit(2 * camera.distance * Math.tan((camera.fovy * Math.PI) / 360))
    const hasArrows = this.config.overlays.some((name) => name in main.arrows)
    if (hasArrows) main.pictures[0] = packed(this.fresh({ ...this.config, arrows: main.arrows }, picture))
  }

  /** Do something with a fresh lab whose failures are known: they are not noted again, nor under another attempt. */
  fresh(config, action) {
    const { failures, reportedKeys, during } = this
    const lab = new Lab(this.engine, this.bytes, config, this.code)
    try {
      Object.assign(this, { failures: [], reportedKeys: new Set() })
      lab.start()
      return action(lab)
    } finally {
      lab.dispose()
      Object.assign(this, { failures, reportedKeys, during })
    }
  }

  // --- one attempt

  /** Do something with a fresh lab, and note its failures under their own entries. */
  attempt(entry, title, action) {
    this.during = { entry, what: title }
    current.trying = entry
    progress.last = this.now()
    let lab = null
    let result = null
    try {
      lab = new Lab(this.engine, this.bytes, this.config, this.code)
      lab.start()
      this.checkState(lab)
      this.framing?.begin()
      result = action(lab)
      this.checkShared(action)
    } catch (error) {
      if (error instanceof Ended) throw error
      this.checkShared(action) // which may be the cause
      this.noteError(error, lab?.time ?? null)
    } finally {
      lab?.dispose()
    }
    this.attempts.push({ entry, what: title })
    return result
  }

  noteError(error, time) {
    if (error instanceof LabError) this.fail(error.entry, error.kind, error.message, time)
    else this.fail(this.during.entry, error instanceof EngineError ? 'engine' : 'throws', error.message, time)
    if (error.kind === 'engine' || error.fatal || error instanceof WebAssembly.RuntimeError) throw new Ended()
  }

  fail(entry, kind, message, time, key = JSON.stringify([entry, kind, message])) {
    if (this.reportedKeys.has(key)) return
    this.reportedKeys.add(key)
    this.failures.push({ entry, kind, message, at: time, during: this.during ?? null })
  }

  /** Check whether the lab has changed what labs share; then the trial ends, as further attempts would prove nothing. */
  checkShared(action) {
    const names = this.guard?.changes() ?? []
    if (names.length === 0) return
    this.guard.repair()
    this.failures = this.failures.filter(({ during }) => during !== this.during) // consequences of it
    this.fail(this.findGuilty(action), 'shared', names.map((name) => `\`${name}\``).join(', '), null)
    throw new Ended()
  }

  /** The entry whose code changes what labs share, if it does so again. */
  findGuilty(action) {
    let guilty = null
    const { after } = current
    current.after = (entry) => {
      if (guilty !== null || this.guard.changes().length === 0) return
      guilty = entry
      this.guard.repair()
      throw new Ended()
    }
    try {
      this.fresh(this.config, action)
    } catch {
      // That is how it ends.
    } finally {
      current.after = after
      this.guard.repair()
    }
    return guilty ?? this.during.entry
  }

  /** Note divergence and warnings of the lab. */
  checkState(lab) {
    const { entry } = this.during
    for (const { kind, message, time } of lab.takeWarnings()) {
      this.fail(entry, 'warning', `${kind}: ${message}`, time, JSON.stringify([entry, kind])) // the first of its kind
    }
    if (lab.diverged !== null) this.fail(entry, 'diverged', lab.diverged.message, lab.diverged.time)
  }

  /** Note bodies that steps have brought deep into each other, once for each attempt. */
  checkDepth(lab) {
    if (lab.steps === 0 || lab.diverged !== null) return
    const contact = deepContact(this.engine, lab.model, lab.data)
    if (contact === null) return
    const { entry } = this.during
    const message = `${contact.names.join(' and ')} by ${Number(contact.depth.toPrecision(2))} m`
    this.fail(entry, 'deep', message, lab.time, JSON.stringify([entry, 'deep']))
  }

  /** Evaluate all readouts and traces, also after one has failed. */
  checkValues(lab) {
    const env = lab.sync()
    this.code.readouts.forEach((run, i) => this.value(['readouts', i, 'expr'], run, env, readable, this.isIntended))
    this.code.plots.forEach((traces, i) =>
      traces.forEach((run, j) => this.value(curveEntry(this.config.plots[i], i, j), run, env, plottable, this.isIntended)),
    )
  }

  /**
   * Evaluate an expression. `check(entry, value)` returns the value or throws.
   * @param {(value: any) => boolean} [isIntended] whether it may be NaN or infinite
   */
  value(entry, run, env, check, isIntended = () => false) {
    try {
      const value = call(entry, () => check(entry, run(env)))
      if (typeof value !== 'number' || Number.isFinite(value) || isIntended(value)) return value
      this.fail(entry, 'nan', `is ${value}`, env.data.time)
    } catch (error) {
      this.noteError(error, env.data.time)
    }
    return null
  }

  /** Step until simulated time `t`, at most `maxSteps`; returns why it ended early, else null. */
  advance(lab, t, maxSteps = Infinity, stops = []) {
    let left = maxSteps
    const startTime = lab.time
    while (left > 0) {
      const timestep = lab.option.timestep
      const due = Math.round((t - lab.time) / timestep)
      if (!(due > 0)) return null
      const sliceStart = (progress.last = this.now())
      const { steps, stopped: reason } = lab.step(Math.min(due, left, SLICE))
      if (lab.recorder === null) {
        // recording costs time of its own
        this.steps += steps
        this.took += (this.now() - sliceStart) / 1000
      }
      if (lab.diverged === null) this.observe(lab)
      left -= steps
      this.checkState(lab)
      if (reason === 'diverged' || stops.includes(reason)) return reason
      if (steps === 0) throw new Error(`no step can be made at t = ${startTime}`)
    }
    return 'steps'
  }

  observe(lab) {
    this.framing.observe(lab)
    this.motion?.observe(lab)
    this.arrowScales.observe(lab)
  }

  probe(lab) {
    this.checkState(lab)
    this.checkValues(lab)
    this.advance(lab, lab.time + PROBE.seconds, PROBE.steps)
    this.checkDepth(lab)
    if (lab.diverged === null) this.checkValues(lab)
  }

  // --- the main run

  mainRun(lab) {
    const { stopAt } = this.config
    const timestep = lab.option.timestep
    const seconds = this.seconds ?? stopAt ?? SECONDS
    const maxSteps = this.seconds === null ? STEPS : Infinity
    const due = Math.min(maxSteps, Math.ceil(seconds / timestep))
    this.framing = new Framing(lab, lab.scene().camera)
    this.motion = new Motion(lab)
    this.framing.begin()
    this.observe(lab)
    this.checkValues(lab)
    const start = picture(lab)
    const atStart = lab.state().physics
    if (this.parity) lab.recorder = new ParityRecorder(lab, this.bytes, due)
    const end = lab.time + seconds
    let reason = null
    for (let i = 1; i <= CHECKS && lab.diverged === null && reason === null; i++) {
      const t = lab.time + (end - lab.time) / (CHECKS + 1 - i)
      const result = this.advance(lab, t, Math.ceil(maxSteps / CHECKS), ['stopAt', 'code'])
      if (result === 'stopAt' || result === 'code') reason = result
      this.checkDepth(lab)
      if (lab.diverged === null) this.checkValues(lab)
    }
    if (stopAt !== null && reason !== 'stopAt' && lab.diverged === null && lab.time >= stopAt) {
      this.fail(['stopAt'], 'stopAt', `the lab does not stop at ${stopAt} s`, lab.time)
    }
    this.endMotion(lab)
    const parity = lab.recorder?.result() ?? null
    lab.recorder = null
    const pictures = packed([start, picture(lab)])
    for (const name of OVERLAYS) lab.pictures.setOverlay(name, true)
    lab.frame(null)
    return {
      seconds: lab.time,
      steps: lab.steps,
      stopped: reason,
      diverged: lab.diverged !== null,
      timestep,
      scene: packed(withSmallTextures(lab.scene())),
      pictures,
      plots: record(lab),
      reach: this.reach,
      parity,
      fallen: fallenBodies(lab, this.engine, this.framing.fallen),
      film: [], // see `film`
      fill: null, // see `frame`; likewise those below
      moved: null,
      arrows: null,
      resetDiffers: resetDiffers(lab, atStart),
    }
  }

  // --- claims and the goal

  claims() {
    const numbered = this.config.expect.map((claim, i) => ({ ...claim, i }))
    for (const claims of Map.groupBy(numbered, ({ after }) => JSON.stringify(after)).values()) {
      claims.sort((a, b) => a.t - b.t)
      this.attempt(['expect', claims[0].i], describe(claims[0].after), (lab) => this.checkClaims(lab, claims))
    }
  }

  goal() {
    const { goal, stopAt } = this.config
    if (!goal) return
    const { hold, log } = goal
    const seconds = this.seconds ?? stopAt ?? SECONDS
    const reachedAt = this.attempt(['goal', 'log'], 'the log of the goal', (lab) => {
      lab.replay({ values: [...lab.values], events: log })
      const outcome = this.pursue(lab, (log.at(-1)?.[0] ?? 0) + hold + seconds)
      const shortfall = hold > 0 ? `it is held for ${rounded(outcome.longest)} s at the most, not ${hold} s` : 'its condition is never true'
      if (outcome.reached === null) this.fail(['goal', 'log'], 'goal', `by ${rounded(lab.time)} s: ${shortfall}`, lab.time)
      return outcome.reached
    })
    this.attempt(['goal', 'expr'], 'the goal with nothing done', (lab) => {
      const outcome = this.pursue(lab, log.length > 0 ? Math.max(seconds, reachedAt ?? 0) : lab.time)
      if (outcome.reached === null) return
      const occasion = lab.steps === 0 ? 'at the start' : `with nothing done, at ${rounded(outcome.reached)} s`
      this.fail(['goal', 'expr'], 'goal', occasion, outcome.reached)
    })
  }

  /** Step until the goal is reached, or until time `t`. */
  pursue(lab, t) {
    const { goal } = lab.sampler
    const open = () => goal.reached === null && lab.diverged === null && t - lab.time > lab.option.timestep / 2
    while (open()) this.advance(lab, Math.min(t, lab.time + Math.max(0.5, lab.option.timestep)))
    return goal
  }

  checkClaims(lab, claims) {
    act(lab, this.config.controls, claims[0].after)
    for (const { i, t, min, max, diverges } of claims) {
      const entry = ['expect', i, 'expr']
      this.during.entry = current.trying = ['expect', i]
      if (lab.diverged === null) this.advance(lab, t)
      else this.checkState(lab)
      this.checkDepth(lab)
      if (diverges && lab.diverged === null) this.fail(['expect', i], 'expect', `the simulation has not diverged at ${t} s`, lab.time)
      if (lab.diverged !== null && !claims.some((claim) => claim.diverges)) return
      if (diverges || lab.diverged !== null) continue
      const value = this.value(entry, this.code.expect[i], lab.sync(), numeric)
      if (value === null) continue
      if (min !== null && value < min) this.fail(entry, 'expect', `is ${value} at ${t} s, less than ${min}`, lab.time)
      if (max !== null && value > max) this.fail(entry, 'expect', `is ${value} at ${t} s, more than ${max}`, lab.time)
    }
  }
}
