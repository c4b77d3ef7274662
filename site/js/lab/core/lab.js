/**
 * A lab: a model, the author's code, and the rules by which the code is run.
 *
 *   const lab = new Lab(engine, bytes, config, code)
 *   lab.start(); lab.step(100); lab.readouts(); lab.dispose()
 *
 * There are two MjData. `data` is the simulation. `shown` is brought up to date from it with mj_forward whenever something is
 * looked at: readouts, traces, claims and pictures see it. So what they show belongs to one moment (after mj_step, positions are
 * new and everything derived from them is old), and looking, however often, changes no bit of the motion.
 */

import { contactList, createLib } from './lib.js'
import { call, readable } from './piece.js'
import { Drag } from './drag.js'
import { generator } from './random.js'
import { Pictures } from './frame.js'
import { Sampler } from './sampler.js'
import { Watch } from './watch.js'

export class Lab {
  /**
   * @param {import('./engine.js').Engine} engine
   * @param {Uint8Array} bytes the model, an MJB file
   * @param {object} config the lab's data (coursebuild/labs/compile.py)
   * @param {object} code the lab's functions (ditto)
   * @param {{play?: () => void, pause?: () => void}} [host] what `sim.play()` and `sim.pause()` do besides
   */
  constructor(engine, bytes, config, code, host = {}) {
    this.engine = engine
    this.config = config
    this.code = code
    this.host = host
    this.recorder = null // of each step, for the trial
    this.handles = engine.load(bytes)
    try {
      this.build()
    } catch (error) {
      this.dispose()
      throw error
    }
  }

  build() {
    const { engine, config, code, handles } = this
    const { mj, k } = engine
    const { model, data, shown } = handles
    Watch.keep(engine, model)
    this.model = model
    this.data = data
    this.option = model.opt // every access through the model would make a new object
    this.paused = !config.autoplay
    this.key = keyframe(engine, model, config.key)
    this.ctx = {}
    this.scratch = { force: handles.own(new mj.DoubleBuffer(6)) }
    this.watch = new Watch(engine, model, data)
    this.sampler = new Sampler(config, code, siteOf(engine, model, config.trail))
    this.pictures = new Pictures(engine, handles, config, this.sampler)
    this.drag = new Drag(engine, handles, this.pictures.scene)
    this.signature = k.state.INTEGRATION
    this.stateSize = mj.mj_stateSize(model, this.signature)
    this.stateBuffer = handles.own(new mj.DoubleBuffer(Math.max(1, this.stateSize)))
    this.env = this.environment(data, true)
    this.view = this.environment(shown, false)
    this.warnings = []
    this.forget()
  }

  /** What lab code sees; code that only looks (`acts` is false) may not act. */
  environment(data, acts) {
    const { engine, model, ctx, scratch } = this
    const act = (name, action) =>
      acts
        ? action
        : () => {
            throw new Error(`${name}() is not for code that only looks`)
          }
    const random = act('lib.random', () => this.draw())
    const lab = this
    const sim = Object.freeze({
      get time() {
        return data.time
      },
      get paused() {
        return lab.paused
      },
      play: act('sim.play', () => this.setPaused(false)),
      pause: act('sim.pause', () => this.setPaused(true)),
      reset: act('sim.reset', () => this.reset()),
      step: act('sim.step', (n = 1) => void this.step(n)),
      contacts: () => contactList(engine, model, data, scratch),
    })
    return Object.freeze({ model, data, mj: engine.mj, sim, ctx, lib: createLib(engine, model, data, scratch, random) })
  }

  // --- life

  /** Begin: every control at its value, then as after a reset. Controls without `init` are applied here only. */
  start() {
    this.values = this.config.controls.map(initialValue)
    this.applyParams()
    this.toKeyframe()
    this.config.controls.forEach((control, i) => {
      if (!control.init && !this.isParam(i)) this.apply(i)
    })
    this.prepare()
  }

  /** The keyframe, the parameters, `setup`, then the controls with `init`. */
  reset() {
    this.applyParams()
    this.toKeyframe()
    this.prepare()
  }

  toKeyframe() {
    const { engine, model, data, key } = this
    if (key < 0) engine.mj.mj_resetData(model, data)
    else engine.mj.mj_resetDataKeyframe(model, data, key)
    this.draw = generator(this.config.seed ?? 0)
    this.drag.release()
    engine.mj.mj_forward(model, data)
  }

  prepare() {
    if (this.code.setup) call(['setup'], () => this.code.setup(this.env))
    this.config.controls.forEach((control, i) => {
      if (control.init && !this.isParam(i)) this.apply(i)
    })
    this.forget()
    this.settle()
  }

  /** A new run begins at the present state. */
  forget() {
    this.steps = 0
    this.diverged = null
    this.sampler.clear()
    this.watch.restart()
    this.dirty = true
  }

  /** After lab code: what is derived becomes current, and what went wrong is noticed. */
  settle() {
    const { engine, model, data } = this
    if (data.time < this.sampler.last) this.forget() // the code has put the time back, which begins a new run
    engine.mj.mj_forward(model, data)
    this.dirty = true
    this.diverged = null
    const time = data.time
    for (const finding of this.watch.raised(time)) this.note(finding)
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

  isParam(i) {
    return this.config.controls[i].param != null
  }

  applyParams() {
    this.config.controls.forEach((_, i) => {
      if (this.isParam(i)) this.apply(i)
    })
  }

  apply(i) {
    const control = this.code.controls[i]
    const value = this.values[i]
    if (control.set && value !== null) call(['controls', i], () => control.set(this.env, value))
  }

  /** Set a slider or a list to a value. */
  setControl(i, value) {
    checkValue(this.config.controls[i], i, value)
    this.values[i] = value
    this.apply(i)
    if (this.config.controls[i].reset) this.reset()
    else this.settle()
  }

  /** Press a button. */
  press(i) {
    const control = this.code.controls[i]
    if (!control?.run) throw new RangeError(`control ${i} is not a button`)
    this.engine.mj.mj_forward(this.model, this.data)
    call(['controls', i, 'run'], () => control.run(this.env))
    this.settle()
  }

  setPaused(paused) {
    this.paused = paused
    if (paused) this.interrupted = true
    const tell = paused ? this.host.pause : this.host.play
    tell?.()
  }

  // --- running

  /**
   * Make at most `n` steps. It ends early when the lab diverges (`diverged` says how), when its time reaches `stopAt`, and
   * when its code calls `sim.pause()`.
   *
   * @returns {{steps: number, stopped: null | 'diverged' | 'stopAt' | 'code'}}
   */
  step(n) {
    if (this.stepping) throw new Error('sim.step() within a step is not possible')
    this.stepping = true
    this.interrupted = false
    let steps = 0
    let stopped = this.diverged === null ? null : 'diverged'
    try {
      while (stopped === null && steps < n) {
        stopped = this.one()
        steps += 1
      }
    } finally {
      this.stepping = false
    }
    return { steps, stopped }
  }

  one() {
    const { engine, model, data, drag, recorder } = this
    recorder?.begin()
    if (this.code.controller) call(['controller'], () => this.code.controller(this.env))
    recorder?.controlled()
    const before = data.time
    drag.push()
    engine.mj.mj_step(model, data)
    drag.pop()
    recorder?.end()
    this.steps += 1
    this.dirty = true
    const findings = this.watch.look(before)
    if (findings !== null) {
      findings.warnings.forEach((finding) => this.note(finding))
      if ((this.diverged = findings.diverged) !== null) return 'diverged'
    }
    const timestep = this.option.timestep
    if (this.sampler.due(this.steps, timestep)) this.sampler.record(this.sync())
    const { stopAt } = this.config
    const late = stopAt === null ? Infinity : stopAt - timestep / 2
    if (before < late && data.time >= late) return 'stopAt'
    return this.interrupted ? 'code' : null
  }

  /** Bring `shown` up to date, and return what looking code sees. */
  sync() {
    if (this.dirty) {
      const { mj } = this.engine
      mj.mj_copyState(this.model, this.data, this.view.data, this.signature)
      mj.mj_forward(this.model, this.view.data)
      this.dirty = false
    }
    return this.view
  }

  // --- looking

  get time() {
    return this.data.time
  }

  /** The readouts: a number or a text each. */
  readouts() {
    const env = this.sync()
    return this.code.readouts.map((run, i) => {
      const entry = ['readouts', i, 'expr']
      return call(entry, () => readable(entry, run(env)))
    })
  }

  /** The traces of all plots in turn, evaluated now. */
  sample() {
    return this.sampler.evaluate(this.sync())
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
   * Drag a body by a spring.
   *
   * @param {{body?: number, point?: number[], target: number[]} | null} request with a `point` (m, world) the body is taken hold of
   *   there; the spring draws it to `target`; `null` lets go
   */
  perturb(request) {
    if (request === null) return this.drag.release()
    if (request.point) {
      this.engine.mj.mj_forward(this.model, this.data)
      this.drag.grab(request.body, request.point)
    }
    this.drag.move(request.target)
    this.dirty = true
  }

  // --- sharing

  /** All that the motion depends on, given model and code: can be cloned and sent. */
  state() {
    const { mj } = this.engine
    mj.mj_getState(this.model, this.data, this.stateBuffer, this.signature)
    return {
      values: [...this.values],
      steps: this.steps,
      time: this.data.time,
      physics: Float64Array.from(this.stateBuffer.GetView().subarray(0, this.stateSize)),
    }
  }

  /** Go to a state: its controls, a reset, and then its physics where it holds any. */
  restore({ values, steps = 0, physics = null }) {
    values.forEach((value, i) => {
      if (value === null || this.config.controls[i]?.type === 'button') return
      checkValue(this.config.controls[i], i, value)
      this.values[i] = value
    })
    this.config.controls.forEach((_, i) => this.apply(i))
    this.reset()
    if (physics === null) return
    if (physics.length !== this.stateSize) {
      throw new RangeError(`a state of ${physics.length} numbers does not fit the model, which has ${this.stateSize}`)
    }
    this.engine.mj.mj_setState(this.model, this.data, Array.from(physics), this.signature)
    this.forget()
    this.steps = steps
    this.settle()
  }
}

function initialValue(control) {
  if (control.type === 'button') return null
  if (control.type === 'select') return control.value ?? control.options[0][1]
  return control.value
}

function checkValue(control, i, value) {
  if (control === undefined || control.type === 'button') throw new RangeError(`control ${i} takes no value`)
  const fits =
    control.type === 'select' ? control.options.some((option) => option[1] === value) : Number.isFinite(value)
  if (!fits) throw new RangeError(`the control "${control.label}" cannot be set to ${JSON.stringify(value)}`)
}

function keyframe(engine, model, key) {
  if (key === null || key === undefined) return -1
  const index = typeof key === 'number' ? key : engine.mj.mj_name2id(model, engine.k.obj.KEY, key)
  if (!(Number.isInteger(index) && index >= 0 && index < model.nkey)) throw new RangeError(`the model has no keyframe ${JSON.stringify(key)}`)
  return index
}

function siteOf(engine, model, name) {
  if (!name) return -1
  const site = engine.mj.mj_name2id(model, engine.k.obj.SITE, name)
  if (site < 0) throw new RangeError(`the model has no site "${name}"`)
  return site
}
