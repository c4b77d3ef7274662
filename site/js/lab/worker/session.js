/**
 * One lab of a page, as the worker runs it: messages in, frames out. docs/explanation/how-labs-run.md has the protocol.
 *
 * Frames are sent only while the page gives their buffers back, so that a page which cannot follow slows nothing but itself. What
 * lab code throws pauses the lab and is told with its entry.
 */

import { Clock } from '../core/clock.js'
import { Lab } from '../core/lab.js'

const CHUNK = 2 // ms of stepping between two looks at the clock
const LEAST = 4 // ms between two frames of a lab that runs

export class Session {
  /**
   * @param {string} id
   * @param {(message: object, transfer?: ArrayBuffer[]) => void} post
   * @param {() => number} now ms
   */
  constructor(id, post, now) {
    this.id = id
    this.post = (type, rest = {}, transfer = []) => post({ type, lab: id, ...rest }, transfer)
    this.now = now
    this.clock = new Clock()
    this.visible = true
    this.playing = false
    this.buffers = [null] // one frame is under way at a time: then there is one for each refresh of the page
    this.stale = true
    this.sent = -Infinity
    this.chunk = 1
    this.lab = null
  }

  /** Begin with what was fetched. */
  open(engine, source, config, code) {
    this.guard(() => {
      const host = { play: () => this.play(), pause: () => this.stop('code') }
      this.lab = new Lab(engine, source, config, code, host)
      this.lab.start()
    })
    if (this.lab === null) return
    const scene = this.lab.scene()
    const { values, time } = this.lab
    this.post('ready', { version: engine.version, scene, values: values ?? [], time }, arrayBuffers(scene))
    this.report()
    if (config.autoplay && !this.lab.diverged && !this.failed) this.play()
  }

  close() {
    this.playing = false
    this.lab?.dispose()
    this.lab = null
  }

  /** Whether time has to be spent on it. */
  get busy() {
    return this.playing && this.visible && this.lab !== null
  }

  // --- messages of the page

  receive(message) {
    const handler = HANDLERS[message.type]
    if (handler === undefined) throw new RangeError(`the worker knows no message "${message.type}"`)
    if (message.type === 'frame') this.buffers.push(message.buffer)
    else if (this.lab !== null) this.guard(() => handler(this, message))
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

  /** Do what a reader asks for; with `play` it goes on from there, unless lab code has paused it. */
  act(action, play) {
    this.lab.interrupted = false
    action(this.lab)
    this.changed()
    if (play && !this.lab.interrupted) this.play()
  }

  /** After lab code has run: the values of the controls, and what became of the state. */
  changed() {
    this.stale = true
    this.post('controls', { values: this.lab.values })
    this.report()
  }

  /** Tell what MuJoCo has warned of. */
  report() {
    for (const { time, kind, message } of this.lab.takeWarnings()) this.post('warning', { time, kind, message })
    const { diverged } = this.lab
    if (diverged === null) {
      this.toldDivergence = null
    } else if (diverged !== this.toldDivergence) {
      this.toldDivergence = diverged
      this.post('diverged', { time: diverged.time, kind: diverged.kind, message: diverged.message })
      this.stop('diverged')
    }
  }

  /** Run something that may fail; a failure is told, and pauses the lab. */
  guard(action) {
    try {
      action()
      return true
    } catch (error) {
      const { entry = [], kind = 'refused' } = error
      const fatal = kind === 'engine' || error.fatal === true || error instanceof WebAssembly.RuntimeError
      this.failed = kind !== 'refused'
      this.post('error', { message: error.message ?? String(error), entry, kind, fatal })
      if (kind !== 'refused' || fatal) this.stop('error')
      return false
    }
  }

  // --- running

  /** Step what is due, for at most `budget` ms; returns the milliseconds until there is more to do. */
  run(budget) {
    if (!this.busy) return Infinity
    const begun = this.now()
    const timestep = this.lab.option.timestep
    let owed = this.clock.owed(begun / 1000, timestep)
    let steps = 0
    this.guard(() => {
      while (owed > 0 && this.playing && this.now() - begun < budget) {
        const started = this.now()
        const made = this.advance(Math.min(owed, this.chunk))
        steps += made.steps
        owed -= made.steps
        this.adapt(this.now() - started, made.steps)
        if (made.stopped !== null) this.ended(made.stopped)
      }
      if (steps > 0) this.report()
    })
    this.clock.ran(steps, timestep, begun / 1000)
    if (steps > 0) this.stale = true
    if (!this.playing) return Infinity
    return owed > 0 ? 0 : Math.max(1, 1000 * this.clock.wait(timestep))
  }

  /** Step, and tell what a log that is replayed has done meanwhile. */
  advance(steps) {
    const { length } = this.lab.queue
    const made = this.lab.step(steps)
    if (this.lab.queue.length !== length) this.changed()
    return made
  }

  /** Choose how many steps to make between two looks at the clock. */
  adapt(took, steps) {
    if (steps < this.chunk) return
    if (took < CHUNK / 2) this.chunk = Math.min(2 * this.chunk, 1024)
    else if (took > CHUNK) this.chunk = Math.max(1, this.chunk >> 1)
  }

  ended(reason) {
    if (reason === 'stopAt') this.stop('stopAt')
  }

  /** Send a frame if there is something new to see and a buffer to put it in. */
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
    const rest = { time: lab.time, buffer: frame.buffer, readouts, samples, realtime, contacts: lab.data.ncon, goal: lab.goal }
    this.post('frame', rest, [frame.buffer, samples.times.buffer, samples.values.buffer])
  }
}

const HANDLERS = {
  frame: () => {},
  play: (session) => session.play(),
  pause: (session) => session.stop('user'),
  step(session, { n }) {
    session.stop('user')
    const { stopped } = session.advance(n ?? 1)
    session.stale = true
    session.report()
    if (stopped === 'stopAt') session.post('paused', { reason: 'stopAt' })
  },
  reset(session) {
    session.lab.reset()
    session.clock.stop()
    session.changed()
  },
  speed: (session, { factor }) => session.clock.setSpeed(factor),
  control: (session, { index, value, play }) => session.act((lab) => lab.setControl(index, value), play),
  press: (session, { index, play }) => session.act((lab) => lab.press(index), play),
  overlay(session, { name, on }) {
    session.lab.pictures.setOverlay(name, on)
    session.stale = true
  },
  visible(session, { on }) {
    if (session.visible === on) return
    session.visible = on
    session.clock.stop()
    if (session.playing) session.post(on ? 'playing' : 'paused', on ? {} : { reason: 'offscreen' })
  },
  perturb(session, { body, point, target }) {
    session.lab.perturb(target === null || target === undefined ? null : { body, point, target })
    session.stale = true
  },
  state: (session) => session.post('state', { state: session.lab.state() }),
  restore(session, { state }) {
    session.lab.restore(state)
    session.clock.stop()
    session.changed()
  },
  replay(session, { log }) {
    session.lab.replay(log)
    session.clock.stop()
    session.changed()
    session.play()
  },
}

/** The buffers of all arrays inside a value, each once. */
export function arrayBuffers(value, found = new Set()) {
  if (ArrayBuffer.isView(value)) found.add(value.buffer)
  else if (value !== null && typeof value === 'object') Object.values(value).forEach((item) => arrayBuffers(item, found))
  return [...found]
}
