/**
 * What a run was: its states, one every few steps, from which each step is found again to the last bit.
 *
 * A state holds all that the next step depends on: MuJoCo's numbers, the lab's `ctx`, its controls and its random numbers. What is derived
 * (`xpos`, sensors, contacts) is that of the step before; so the numbers before a step are kept, and the step is made again. Where a
 * hand pulled it need not end as it did: there those after it are kept, too. After something was done to the lab, the numbers are those
 * before `mj_forward`. Where code may change the model, a state holds what of the model has changed. Between two states steps are
 * repeated, unless a body was pulled there: then the run can be looked at in the states only. When there are too many, every second
 * one goes.
 *
 * The lab may stand at an earlier step of its tape. What then happens to it, or the next step that it makes, drops what came after.
 */

import { ModelWords } from './structs.js'

const MOST = 1500 // states
const LEAST = 4
const MOST_NUMBERS = 1_000_000 // in all of them, 8 MB
const LARGEST = 5000 // values that `ctx` may hold, and those of the model that may change
const SAMPLES = 16 // of the plots, between two states
const MOST_MARKS = 200
const APART = 0.3 // s between two marks of one control, or of contacts
const TOLERANCE = 1e-6 // of a step

export class Tape {
  /** @param {import('./lab.js').Lab} lab */
  constructor(lab) {
    this.lab = lab
    this.most = MOST
    const { code, config, model, data } = lab
    this.model = code.controller || config.controls.length > 0 ? new ModelWords(model, data) : null
    this.clear()
  }

  /** Begin a new run. */
  clear() {
    this.states = []
    this.model?.begin()
    this.stride = 0 // steps between two states; 0: not known yet
    this.isKept = true // no longer if `ctx` holds what cannot be copied
    this.end = { step: -1, time: 0, log: null } // the last step; -1: none yet
    this.marks = []
    this.touches = []
    this.contacts = -1 // in the last step; -1: not known
  }

  /**
   * The times (s) between which the lab can be put, those at which a control was used, `[time, control]`, and those at which bodies have
   * begun or ceased to touch.
   */
  get range() {
    const { end, marks, touches } = this
    const start = this.states[0]?.time ?? this.lab.time
    return { start, end: end.step < 0 ? start : end.time, marks, touches }
  }

  /** Whether the lab stands at an earlier step. */
  get isPast() {
    return this.lab.steps < this.end.step
  }

  // --- recording

  /** The numbers before the step that begins, and what of the model has changed, if its state is to be kept. */
  before() {
    const { lab } = this
    if (!this.isKept) return null
    if (this.stride === 0) this.stride = Math.max(1, SAMPLES * Math.round(lab.sampler.interval / lab.option.timestep))
    const stride = lab.drag.active ? Math.ceil(this.stride / SAMPLES) : this.stride
    return (lab.steps + 1) % stride === 0 ? { before: lab.physics.read(), model: this.model?.read() } : null
  }

  /** A step was made. @param {ReturnType<Tape['before']>} begun @param {number} time s */
  after(begun, time) {
    const { drag, physics } = this.lab
    if (begun !== null) this.keep({ ...begun, numbers: drag.active ? physics.read() : null })
    this.touch(time)
    this.markEnd(time)
  }

  /** Note that there are more contacts than in the step before, or less. */
  touch(time) {
    const { touches, contacts } = this
    this.contacts = this.lab.watch.numbers.contacts
    if (contacts < 0 || contacts === this.contacts || time - touches.at(-1) < APART) return
    this.touches = [...touches, time].slice(-MOST_MARKS)
  }

  /** Something was done to the lab; @param {Float64Array} numbers before `mj_forward` */
  event(numbers) {
    this.cut()
    const { steps } = this.lab
    this.states = this.states.filter(({ step }) => step < steps)
    this.keep({ before: null, numbers, model: this.model?.read() })
    this.markEnd(this.lab.time)
  }

  /** A control was used. */
  mark(control) {
    const { time } = this.lab
    const last = this.marks.findLast((mark) => mark[1] === control)
    if (this.lab.steps === 0 || (last !== undefined && time - last[0] < APART)) return
    this.marks = [...this.marks, [time, control]].slice(-MOST_MARKS)
  }

  markEnd(time) {
    const { end, lab } = this
    end.step = lab.steps
    end.time = time
    end.log = lab.log
  }

  /** @param {{before: Float64Array | null, numbers: Float64Array | null, model?: Int32Array}} moment */
  keep(moment) {
    const { lab } = this
    const { copy: ctx, size: held } = copyOf(lab.ctx, lab.physics.memory)
    const size = held + (moment.model?.length ?? 0) / 2
    if (size > LARGEST) {
      this.states = []
      this.isKept = false
      return
    }
    this.states.push({
      step: lab.steps,
      time: lab.time,
      ...moment,
      ctx,
      values: [...lab.values],
      random: lab.draw.read(),
      seen: lab.sampler.read(),
      isPulled: lab.drag.active,
    })
    const room = Math.max(LEAST, Math.floor(MOST_NUMBERS / (2 * lab.physics.size + size)))
    if (this.states.length > Math.min(this.most, room)) this.thin()
  }

  /** Drop every second state; those after which steps cannot simply be repeated go last. */
  thin() {
    const events = this.states.filter(({ before }) => before === null).length
    let drops = false
    const kept = []
    for (const state of this.states) {
      const isEvent = state.before === null
      if (kept.length > 0 && (!isEvent || 2 * events > this.most)) drops = !drops
      else drops = false
      if (!drops) kept.push(state)
      else if (isEvent || state.isPulled) kept[kept.length - 1].isPulled = true
    }
    this.states = kept
    this.stride *= 2
  }

  /** Drop what came after the step at which the lab stands. */
  cut() {
    if (!this.isPast) return
    const { steps, time } = this.lab
    this.states = this.states.filter(({ step }) => step <= steps)
    this.marks = this.marks.filter(([at]) => at <= time)
    this.touches = this.touches.filter((at) => at <= time)
    this.lab.sampler.cut(time)
    this.markEnd(time)
  }

  // --- going to a step

  /** Go to the last step that is not after a time (s). */
  seek(time) {
    const { lab, states } = this
    const state = states.findLast((item) => item.time <= time + TOLERANCE * lab.option.timestep) ?? states[0]
    if (state === undefined) return
    this.restore(state)
    this.repeat(state, state.step + Math.floor((time - state.time) / lab.option.timestep + TOLERANCE))
  }

  go(step) {
    const state = this.states.findLast((item) => item.step <= step) ?? this.states[0]
    if (state === undefined) return
    this.restore(state)
    this.repeat(state, step)
  }

  restore({ before, numbers, model, ctx, values, random, seen, step }) {
    const { lab } = this
    const { mj } = lab.engine
    lab.queue = []
    lab.drag.release()
    lab.controls.values = [...values]
    this.model?.write(model)
    for (const name of Object.keys(lab.ctx)) delete lab.ctx[name]
    Object.assign(lab.ctx, copyOf(ctx, lab.physics.memory).copy)
    lab.physics.write(before ?? numbers)
    if (before === null) mj.mj_forward(lab.model, lab.data)
    else {
      mj.mj_step(lab.model, lab.data)
      if (numbers !== null) lab.physics.write(numbers)
    }
    lab.draw.write(random)
    lab.sampler.write(seen)
    lab.steps = step
    this.contacts = -1
  }

  /** Repeat the steps from a state up to another step, unless the hand that pulled then is missing. */
  repeat(state, step) {
    const { lab, end } = this
    const last = Math.min(step, end.step)
    while (!state.isPulled && lab.steps < last) lab.advance()
    const { log } = end
    lab.log = log === null || lab.steps === end.step ? log : { ...log, events: log.events.filter(([at]) => at <= lab.time + TOLERANCE) }
    lab.arrive()
  }
}

/**
 * A copy of what a lab keeps in `ctx`, and how many values it holds: infinitely many, if one cannot be copied. Functions, and what belongs
 * to the engine, are taken as they are.
 *
 * @param {ArrayBuffer} memory of the engine
 */
function copyOf(ctx, memory) {
  let size = 0
  const copies = new Map() // by the objects, which may be held twice, or hold themselves
  const copy = (/** @type {any} */ value) => {
    size += 1
    if (size > LARGEST || typeof value !== 'object' || value === null) return value
    if (value.buffer === memory || '$$' in value) return value
    if (copies.has(value)) return copies.get(value)
    /** @type {any} */
    const kind = [Array, Map, Set, Object].find((type) => Object.getPrototypeOf(value) === type.prototype)
    if (ArrayBuffer.isView(value) && !(value instanceof DataView)) {
      size += value.byteLength / 8
      return size > LARGEST ? value : /** @type {any} */ (value).slice()
    }
    if (kind === undefined || value.length > LARGEST) {
      size = Infinity
      return value
    }
    const target = new kind()
    copies.set(value, target)
    if (kind === Map) for (const [key, item] of value) target.set(copy(key), copy(item))
    else if (kind === Set) for (const item of value) target.add(copy(item))
    else for (const [name, item] of Object.entries(value)) target[name] = copy(item)
    return target
  }
  return { copy: copy(ctx), size }
}
