/**
 * One lab of a page, as the worker runs it: messages in, frames out.
 *
 * Frames are sent only while the page gives their buffers back, so that a page which cannot follow slows nothing but itself. An
 * exception of lab code pauses the lab and is reported with its entry.
 *
 * Messages have a `type`, and the `lab` that they are about. Those that arrive while a lab is loading are kept, and
 * handled afterwards. To the worker:
 *
 *   load {config, module, mjb, wasm, own}  fetch what is missing and start the lab; `module`, `mjb` and `wasm` are absolute addresses. A
 *                                     model in `config.xml` replaces `mjb`, and may name the files of `own`, `{main, files}`, where it lies
 *                                     at the path `main`, and with `config.isOther` is none to which the lab's camera belongs; without a `module` the lab has no code but a start from the first keyframe
 *   ping                              answered by `pong`, unless something takes all the worker's time
 *   play, pause, reset
 *   step {n}                          pause and make `n` steps, or go back by as many if it is negative
 *   seek {time}                       pause and go to another time of the run (core/tape.js)
 *   speed {factor}                    simulated seconds for each real one
 *   control {index, value, play}      set a number or an option; with `play` the lab then runs, unless its code pauses
 *   press {index, play}               press a button; `play` likewise
 *   inspect {on}                      begin or stop to send what the model offers (core/panel.js)
 *   examine {part}                    send the numbers of a part with each frame: `{kind, index}`, a body, joint or geom; `null`: of none
 *   actuate {index, value, play}      set the control signal of an actuator; `play` as above
 *   keyframe {index}                  begin again at a keyframe of the model
 *   overlay {name, on}                one of `OVERLAYS` in core/frame.js
 *   point {name}                      draw an overlay, with thick arrows, while the reader points at it; `null` ends that
 *   visible {on}                      a lab out of sight makes no steps and sends no frames
 *   perturb {body, point, target}     with `point` (m, world) take hold of the body there; draw it to `target`; `null` lets go.
 *                                     A lab that is paused moves its pose; else a spring pulls
 *   frame {buffer}                    give a frame's buffer back (or `null` if it is lost)
 *   replay {log}                      begin again and play the log (core/lab.js)
 *   state                             ask for the state
 *   restore {state}                   go to a state; `{values}` alone sets the controls and resets
 *   dispose                           free everything
 *
 * To the page:
 *
 *   ready {version, scene, values, time}  `scene` of core/scene.js; `values` of the controls, `null` for none yet
 *   model {model}                     what the model offers, or `null`: the answer to `inspect`
 *   frame {time, buffer, readouts, samples, realtime, goal, panel, tape}
 *   playing
 *   paused {reason}                   `user`, `stopAt`, `code`, `diverged`, `error`, `offscreen`
 *   controls {values}                 after anything that lab code may have changed
 *   diverged {time, kind, message}, warning {time, kind, message}
 *   error {message, entry, kind, fatal}  `entry`: the way into the lab's JSON, such as `["controls", 2, "run"]`; `kind`: `throws`,
 *                                     `type`, `engine`, `load`, or `refused` for an impossible message, which alone does not pause
 *                                     the lab. After a `fatal` one the page ends the worker, and may start another
 *   state {state}                     `{values, steps, time, physics, log}`
 *
 * Of a frame: `buffer` is laid out as core/frame.js says, and transferred, not copied. `readouts` has a number, a text or `null` (no
 * value) each; it is `null` as a whole if one of them failed. `samples` is `{epoch, from, times, values}` since the last frame: for each
 * time one number for each trace of all plots in turn, NaN for a gap; a new `epoch` means that the run began again, and what lies after
 * `from` no longer belongs to it. `tape` is the `range` of core/tape.js. `realtime` is how
 * much of the time due in the last second was simulated: 1 unless the model is too slow. `goal` is `null` or `{held, reached,
 * counts}`: for how long its condition has held (s), when it was reached (s or `null`), and whether the reader has used the controls
 * alone. `panel` is `null` or, of a lab that is inspected, `{ctrl, sensors, driven, rows}`; `rows` has the numbers of the part that is examined.
 */

import { Clock } from '../core/clock.js'
import { limitDetail } from '../core/detail.js'
import { Framing } from '../core/framing.js'
import { Lab } from '../core/lab.js'
import { Tape } from '../core/tape.js'

const CHUNK = 2 // ms of stepping between two looks at the clock
const LEAST = 4 // ms between two frames of a running lab

export class Session {
  /**
   * @param {string} id
   * @param {(message: Record<string, any>, transfer?: ArrayBuffer[]) => void} post
   * @param {() => number} now ms
   */
  constructor(id, post, now) {
    this.id = id
    this.post = (type, rest = {}, transfer = []) => post({ type, lab: id, ...rest }, transfer)
    this.now = now
    this.clock = new Clock()
    this.visible = true
    this.playing = false
    this.buffers = [null] // a single one: the next frame is sent when the page has returned it, so at most once per refresh
    this.stale = true
    this.sent = -Infinity
    this.chunk = 1
    this.lab = null
  }

  /** Start the lab from the fetched model, data and code. */
  open(engine, source, config, code, own = null) {
    this.guard(() => {
      const host = { play: () => this.play(), pause: () => this.stop('code') }
      this.lab = new Lab(engine, source, config, code, host, own)
      this.lab.tape = new Tape(this.lab)
      this.lab.start()
    })
    if (this.lab === null) return
    const scene = limitDetail(this.lab.scene(), engine.k.geom)
    if (config.isOther) scene.floor = floorOf(this.lab, scene.camera)
    const { values, time } = this.lab
    this.post('ready', { version: engine.version, scene, values: values ?? [], time }, arrayBuffers(scene))
    this.report()
    if (config.autoplay && !this.lab.diverged && !this.hasFailed) this.play()
  }

  close() {
    this.playing = false
    this.lab?.dispose()
    this.lab = null
  }

  /** Whether the lab needs time. */
  get busy() {
    return this.playing && this.visible && this.lab !== null
  }

  // --- messages of the page

  receive(message) {
    const handler = HANDLERS[message.type]
    if (handler === undefined) throw new RangeError(`the worker knows no message "${message.type}"`)
    if (this.lab !== null) this.guard(() => handler(this, message))
  }

  play() {
    if (this.playing || this.lab === null) return
    if (this.lab.diverged !== null) return void this.report()
    this.playing = true
    this.lab.paused = false
    this.clock.stop()
    this.post('playing')
  }

  stop(reason) {
    if (!this.playing) return
    this.playing = false
    this.lab.paused = true
    this.post('paused', { reason })
  }

  /** Do what a reader asks for; with `play` the lab then runs, unless its code has paused it. */
  act(action, play) {
    this.lab.interrupted = false
    action(this.lab)
    this.afterChange()
    if (play && !this.lab.interrupted) this.play()
  }

  /** Begin another run, in which no time has passed yet. */
  begin(action) {
    action(this.lab)
    this.clock.stop()
    this.afterChange()
  }

  /** After lab code has run: send the values of the controls, warnings and divergence. */
  afterChange() {
    this.stale = true
    this.post('controls', { values: this.lab.values })
    this.report()
  }

  /** Send MuJoCo's warnings, and a divergence once. */
  report() {
    for (const { time, kind, message } of this.lab.takeWarnings()) this.post('warning', { time, kind, message })
    const { diverged } = this.lab
    if (diverged === null) {
      this.reportedDivergence = null
    } else if (diverged !== this.reportedDivergence) {
      this.reportedDivergence = diverged
      this.post('diverged', { time: diverged.time, kind: diverged.kind, message: diverged.message })
      this.stop('diverged')
    }
  }

  /** Run something that may fail; a failure is sent to the page, and pauses the lab. */
  guard(action) {
    try {
      action()
      return true
    } catch (error) {
      const { entry = [], kind = 'refused' } = error
      const fatal = kind === 'engine' || error.fatal === true || error instanceof WebAssembly.RuntimeError
      this.hasFailed = kind !== 'refused'
      this.post('error', { message: error.message ?? String(error), entry, kind, fatal })
      if (kind !== 'refused' || fatal) this.stop('error')
      return false
    }
  }

  // --- running

  /** Make the steps that are due, for at most `budget` ms; returns the milliseconds until there is more to do. */
  run(budget) {
    if (!this.busy) return Infinity
    const startTime = this.now()
    const timestep = this.lab.option.timestep
    let due = this.clock.stepsDue(startTime / 1000, timestep)
    let steps = 0
    this.guard(() => {
      while (due > 0 && this.playing && this.now() - startTime < budget) {
        const sliceStart = this.now()
        const result = this.advance(Math.min(due, this.chunk))
        steps += result.steps
        due -= result.steps
        this.adapt(this.now() - sliceStart, result.steps)
        if (result.stopped === 'stopAt') this.stop('stopAt')
      }
      if (steps > 0) this.report()
    })
    this.clock.countSteps(steps, timestep, startTime / 1000)
    if (steps > 0) this.stale = true
    if (!this.playing) return Infinity
    return due > 0 ? 0 : Math.max(1, 1000 * this.clock.wait(timestep))
  }

  /** Step, and send the changes if a replayed log has acted meanwhile. */
  advance(steps) {
    const { length } = this.lab.queue
    const result = this.lab.step(steps)
    if (this.lab.queue.length !== length) this.afterChange()
    return result
  }

  /** Choose how many steps to make between two looks at the clock. */
  adapt(took, steps) {
    if (steps < this.chunk) return
    if (took < CHUNK / 2) this.chunk = Math.min(2 * this.chunk, 1024)
    else if (took > CHUNK) this.chunk = Math.max(1, this.chunk >> 1)
  }

  /** Send a frame if something has changed and there is a buffer for it. */
  show() {
    if (!this.stale || !this.visible || this.lab === null || this.buffers.length === 0) return
    const now = this.now()
    if (this.playing && now - this.sent < LEAST) return
    this.stale = false
    this.sent = now
    let readouts = null
    this.guard(() => (readouts = this.lab.readouts()))
    this.guard(() => this.send(readouts))
  }

  send(readouts) {
    const { lab } = this
    const frame = lab.frame(this.buffers.pop())
    const samples = lab.sampler.take()
    const realtime = this.playing ? this.clock.ratio() : 1
    const panel = lab.panel?.read() ?? null
    const rest = { time: lab.time, buffer: frame.buffer, readouts, samples, realtime, goal: lab.goal, panel, tape: lab.tape.range }
    this.post('frame', rest, [frame.buffer, samples.times.buffer, samples.values.buffer])
  }
}

const HANDLERS = {
  frame: (session, { buffer }) => session.buffers.push(buffer),
  play: (session) => session.play(),
  pause: (session) => session.stop('user'),
  step(session, { n }) {
    session.stop('user')
    const { tape, steps } = session.lab
    if (n < 0 || tape.isPast) {
      tape.go(Math.max(0, steps + n))
      return session.afterChange()
    }
    const { stopped: reason } = session.advance(n)
    session.stale = true
    session.report()
    if (reason === 'stopAt') session.post('paused', { reason: 'stopAt' })
  },
  seek(session, { time }) {
    session.stop('user')
    session.lab.tape.seek(time)
    session.afterChange()
  },
  reset: (session) => session.begin((lab) => lab.reset()),
  speed: (session, { factor }) => session.clock.setSpeed(factor),
  control: (session, { index, value, play }) => session.act((lab) => lab.setControl(index, value), play),
  press: (session, { index, play }) => session.act((lab) => lab.press(index), play),
  inspect(session, { on }) {
    session.post('model', { model: session.lab.inspect(on) })
    session.stale = true
  },
  examine(session, { part }) {
    if (session.lab.panel !== null) session.lab.panel.part = part
    session.stale = true
  },
  actuate: (session, { index, value, play }) => session.act((lab) => lab.actuate(index, value), play),
  keyframe: (session, { index }) => session.begin((lab) => lab.startAt(index)),
  overlay(session, { name, on }) {
    session.lab.pictures.setOverlay(name, on)
    session.stale = true
  },
  point(session, { name }) {
    session.lab.pictures.point(name)
    session.stale = true
  },
  visible(session, { on }) {
    if (session.visible === on) return
    session.visible = on
    session.clock.stop()
    if (session.playing) session.post(on ? 'playing' : 'paused', on ? {} : { reason: 'offscreen' })
  },
  perturb(session, { body, point, target }) {
    session.lab.perturb(target === null || target === undefined ? null : { body, point, target }, !session.playing)
    session.stale = true
    session.report()
  },
  state: (session) => session.post('state', { state: session.lab.state() }),
  restore: (session, { state }) => session.begin((lab) => lab.restore(state)),
  replay(session, { log }) {
    session.begin((lab) => lab.replay(log))
    session.play()
  },
}

/** The height of the floor of a model as it begins, or null. */
function floorOf(lab, camera) {
  const framing = new Framing(lab, camera)
  framing.begin()
  framing.observe(lab)
  return framing.floor()
}

/** The buffers of all arrays inside a value, without duplicates. */
export function arrayBuffers(value, buffers = new Set()) {
  if (ArrayBuffer.isView(value)) buffers.add(value.buffer)
  else if (value !== null && typeof value === 'object') Object.values(value).forEach((item) => arrayBuffers(item, buffers))
  return [...buffers]
}
