/**
 * A lab: a model, the author's code, and the rules by which the code is run.
 *
 *   const lab = new Lab(engine, source, config, code)
 *   lab.start(); lab.step(100); lab.readouts(); lab.dispose()
 *
 * There are two MjData. `data` is the simulation. `displayData` is copied from it and completed with mj_forward whenever something
 * is looked at: readouts, traces, claims and pictures read it. So all of them show the same moment (after mj_step, positions are
 * new and everything derived from them is old), and looking, however often, changes no bit of the motion.
 */

import { Controls } from './controls.js'
import { Drag } from './drag.js'
import { environment } from './environment.js'
import { Pictures } from './frame.js'
import { keyframe, siteOf } from './names.js'
import { Panel } from './panel.js'
import { call, readable } from './piece.js'
import { generator } from './random.js'
import { Sampler } from './sampler.js'
import { State } from './state.js'
import { Watch } from './watch.js'

const MOST_EVENTS = 10_000 // of a log
const TOLERANCE = 1e-9 // s, of the times in it

export class Lab {
  /**
   * @param {import('./engine.js').Engine} engine
   * @param {Uint8Array | string} source the model, an MJB file or MJCF
   * @param {Record<string, any>} config the lab's data (coursebuild/features/lab/compile.py)
   * @param {Record<string, any>} code the lab's functions (ditto)
   * @param {{play?: () => void, pause?: () => void}} [host] called by `sim.play()` and `sim.pause()`
   * @param {{main: string, files: Map<string, Uint8Array>} | null} [own] files of a model that is MJCF
   */
  constructor(engine, source, config, code, host = {}, own = null) {
    this.engine = engine
    this.config = config
    this.code = code
    this.host = host
    this.recorder = null // records each step for the trial
    this.tape = null // keeps the run, in a page
    this.began = 0 // s, the time before the last step
    this.panel = null // while the reader looks at the model's actuators and sensors
    this.handles = engine.load(source, own)
    try {
      this.build()
    } catch (error) {
      this.dispose()
      throw error
    }
  }

  build() {
    const { engine, config, code, handles } = this
    const { model, data, displayData } = handles
    Watch.disableAutoreset(engine, model)
    this.model = model
    this.data = data
    this.option = model.opt // every access through the model would make a new object
    this.paused = !config.autoplay
    this.key = keyframe(engine, model, config.key)
    this.ctx = {}
    this.scratch = { force: handles.adopt(new engine.mj.DoubleBuffer(6)) }
    this.watch = new Watch(engine, model, data)
    this.sampler = new Sampler(config, code, siteOf(engine, model, config.trail))
    this.pictures = new Pictures(engine, handles, config, this.sampler)
    this.drag = new Drag(engine, handles, this.pictures.scene)
    this.physics = new State(engine, handles)
    this.env = environment(this, data, true)
    this.view = environment(this, displayData, false)
    this.controls = new Controls(config.controls, code.controls, this.env)
    this.warnings = []
    this.queue = [] // the remaining events of a log that is being replayed
    this.forget()
  }

  // --- start and reset

  /** Start with every control at its initial value. Controls without `init` are applied here and not at a reset. */
  start() {
    this.controls.restart()
    this.controls.applyAll('param')
    this.toKeyframe()
    this.controls.applyAll('once')
    this.prepare()
  }

  /** The keyframe, the parameters, `setup`, then the controls with `init`. */
  reset() {
    this.queue = []
    this.controls.applyAll('param')
    this.toKeyframe()
    this.prepare()
  }

  toKeyframe(key = this.key) {
    const { engine, model, data } = this
    if (key < 0) engine.mj.mj_resetData(model, data)
    else engine.mj.mj_resetDataKeyframe(model, data, key)
    this.draw = generator(this.config.seed ?? 0)
    this.drag.release()
    engine.mj.mj_forward(model, data)
  }

  prepare() {
    if (this.code.setup) call(['setup'], () => this.code.setup(this.env))
    this.controls.applyAll('init')
    this.forget()
    this.settle()
  }

  /** Begin a new run at the present state. */
  forget() {
    this.steps = 0
    this.diverged = null
    this.log = this.stepping ? null : { values: [...this.values], events: [] }
    this.sampler.clear()
    this.watch.restart()
    this.tape?.clear()
    this.dirty = true
  }

  /** After lab code has run: update what is derived, and notice warnings and divergence. */
  settle() {
    const { engine, model, data } = this
    if (data.time < this.sampler.last) this.forget() // the code has put the time back, which begins a new run
    this.tape?.event(this.physics.read())
    engine.mj.mj_forward(model, data)
    this.dirty = true
    this.diverged = null
    const time = data.time
    for (const finding of this.watch.takeNew(time)) this.note(finding)
    this.diverged ??= this.watch.badState('qpos', time) ?? this.watch.badState('qvel', time)
    if (this.steps === 0 && this.sampler.active) {
      this.sampler.clear()
      this.sampler.record(this.sync())
    }
  }

  note(finding) {
    if (finding.fatal) this.diverged ??= finding
    else this.warnings.push(finding)
  }

  /** Free the engine's memory. */
  dispose() {
    this.handles.dispose()
  }

  // --- controls

  /** The value of each control; `null`: it has none, or none yet. */
  get values() {
    return this.controls.values
  }

  setControl(i, value) {
    this.act([i, value], () => {
      this.controls.take(i, value)
      this.engine.mj.mj_forward(this.model, this.data)
      this.watched(() => this.controls.apply(i))
      if (this.config.controls[i].reset) this.reset()
      else this.settle()
    })
  }

  press(i) {
    this.act([i], () => {
      this.engine.mj.mj_forward(this.model, this.data)
      this.controls.press(i)
      this.settle()
    })
  }

  /** Do what a reader asks for, and log it. If that begins a new run, it is the first event of the new log. */
  act(event, action) {
    const { log } = this
    const values = [...this.values]
    const time = Number(this.time.toFixed(9))
    this.queue = []
    action()
    this.tape?.mark(event[0])
    if (this.log === null) return
    if (this.log !== log) this.log = { values, events: [[0, ...event]] }
    else if (log.events.length < MOST_EVENTS) log.events.push([time, ...event])
    else this.log = null
  }

  // --- the model's own actuators and keyframes, which no control of the lab stands for

  /** Look at what the model offers, or no longer; returns its description (see panel.js). */
  inspect(on) {
    this.panel = on ? new Panel(this) : null
    return this.panel?.describe() ?? null
  }

  /** Run code that may set actuators. */
  watched(code) {
    if (this.panel === null) code()
    else this.panel.watch(code)
  }

  /** Set the control signal of an actuator. It stays until code or the reader sets another, or the simulation is reset. */
  actuate(i, value) {
    this.data.ctrl[i] = value
    this.leaveControls()
    this.settle()
  }

  /** Begin a new run at a keyframe, without the lab's own start. */
  startAt(key) {
    this.toKeyframe(key)
    this.forget()
    this.leaveControls()
    this.settle()
  }

  /** The reader has done what no control does: the motion has no log any more. */
  leaveControls() {
    this.log = null
    this.queue = []
  }

  // --- the log: what was done in a run since its reset; `null` if the controls alone do not determine the motion

  /**
   * Begin a run that repeats the events of a log, each before the first step at its time or later.
   *
   * @param {{values: unknown[], events: [number, number, unknown?][], end?: number}} log the values of the controls at the reset;
   *   of each event the time, the number of a control and, except for a button, a value; the replay stops at `end` (s)
   */
  replay({ values, events, end = Infinity }) {
    for (const [, i, value] of events) this.controls.check(i, value)
    this.restore({ values })
    this.queue = [...events, [end]]
    this.log.replayed = true
  }

  /** Do the events of the log that are due; returns 'stopAt' at its end. */
  follow() {
    const { queue } = this
    while (queue.length > 0 && this.data.time >= queue[0][0] - TOLERANCE) {
      const [, i, value] = queue.shift()
      if (i === undefined) return 'stopAt'
      if (value === undefined) this.press(i)
      else this.setControl(i, value)
      this.queue = queue
      if (this.log !== null) this.log.replayed = true
    }
    return null
  }

  /** The state of the goal; `counts`: the reader has used nothing but the controls. */
  get goal() {
    const { goal } = this.sampler
    return goal && { held: goal.held, reached: goal.reached, counts: this.log !== null && !this.log.replayed }
  }

  setPaused(paused) {
    this.paused = paused
    if (paused) this.interrupted = true
    const tell = paused ? this.host.pause : this.host.play
    tell?.()
  }

  // --- running

  /**
   * Make at most `n` steps; fewer if the lab diverges (`diverged` says how), its time reaches `stopAt`, or its code calls
   * `sim.pause()`.
   *
   * @returns {{steps: number, stopped: null | 'diverged' | 'stopAt' | 'code'}}
   */
  step(n) {
    if (this.stepping) throw new Error('sim.step() within a step is not possible')
    this.interrupted = false
    this.tape?.cut()
    let steps = 0
    let reason = this.diverged === null ? null : 'diverged'
    while (reason === null && steps < n) {
      reason = this.follow()
      if (reason !== null) break
      this.stepping = true
      try {
        reason = this.stepOnce()
      } finally {
        this.stepping = false
      }
      steps += 1
    }
    return { steps, stopped: /** @type {'code' | 'diverged' | 'stopAt' | null} */ (reason) }
  }

  stepOnce() {
    const { watch, tape } = this
    const numbers = this.advance()
    const before = this.began
    const time = watch.numbers.time
    const findings = watch.look(before, time)
    if (findings !== null) {
      this.warnings.push(...findings.warnings)
      if ((this.diverged = findings.diverged) !== null) return 'diverged'
    }
    const { timestep } = watch.numbers
    if (this.sampler.due(this.steps, timestep)) this.sampler.record(this.sync())
    tape?.after(numbers, time)
    const late = (this.config.stopAt ?? Infinity) - timestep / 2
    if (before < late && time >= late) return 'stopAt'
    return this.interrupted ? 'code' : null
  }

  /** Make a step; returns the numbers before it if the tape wants them. */
  advance() {
    const { engine, model, data, drag, recorder, tape } = this
    recorder?.begin()
    if (this.code.controller) this.watched(() => call(['controller'], () => this.code.controller(this.env)))
    recorder?.controlled()
    this.began = this.watch.numbers.time // which the controller may have set
    drag.push()
    const numbers = tape?.before() ?? null
    engine.mj.mj_step(model, data)
    drag.pop()
    recorder?.end()
    this.steps += 1
    this.dirty = true
    return numbers
  }

  /** After the tape has put the lab elsewhere. */
  arrive() {
    this.diverged = null
    this.watch.restart()
    this.dirty = true
  }

  /** Bring `displayData` up to date; returns the environment of code that only looks. */
  sync() {
    if (this.dirty) {
      this.physics.copy(this.view.data)
      this.engine.mj.mj_forward(this.model, this.view.data)
      this.dirty = false
    }
    return this.view
  }

  // --- looking

  get time() {
    return this.data.time
  }

  /** The readouts: a number or a text each, or `null`. */
  readouts() {
    const env = this.sync()
    return this.code.readouts.map((run, i) => {
      const entry = ['readouts', i, 'expr']
      return call(entry, () => readable(entry, run(env)))
    })
  }

  /** The warnings that MuJoCo raised since the last call. */
  takeWarnings() {
    return this.warnings.splice(0)
  }

  /** The description of what does not move (see `scene.js`). */
  scene() {
    this.sync()
    return this.pictures.describe()
  }

  /** What moves, as floats (see `frame.js`). */
  frame(buffer) {
    this.sync()
    return this.pictures.write(buffer, this.drag)
  }

  // --- dragging

  /**
   * Drag a body: by a spring, or while time stands still by moving the pose.
   *
   * @param {{body?: number, point?: number[], target: number[]} | null} request with a `point` (m, world) the body is taken
   *   hold of there; it is drawn to `target`; `null` lets go
   * @param {boolean} [stands] whether time stands still
   */
  perturb(request, stands = false) {
    if (request === null) {
      if (!this.drag.active) return
      this.drag.release()
      return this.settle()
    }
    this.leaveControls()
    if (request.point) {
      this.engine.mj.mj_forward(this.model, this.data)
      this.drag.grab(request.body, request.point)
      if (this.drag.active) this.settle()
    }
    this.drag.move(request.target)
    this.dirty = true
    if (!stands || this.diverged !== null) return
    this.drag.pose()
    this.settle()
  }

  // --- sharing

  /** All that the motion depends on, given model and code; plain values that can be sent to another thread. */
  state() {
    return { values: [...this.values], steps: this.steps, time: this.data.time, physics: this.physics.read(), log: this.log }
  }

  /** Go to a state: set its controls, reset, and then set its physics if it holds any. */
  restore({ values, steps = 0, physics = null }) {
    values.forEach((value, i) => {
      if (value !== null) this.controls.take(i, value)
    })
    this.controls.applyAll()
    this.reset()
    if (physics === null) return
    this.physics.write(physics)
    this.forget()
    this.steps = steps
    this.log = null
    this.settle()
  }
}
