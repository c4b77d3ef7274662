/**
 * Records a lab while it runs: the traces of its plots, the trail of a site, and how long its goal has held.
 *
 * Samples lie on a grid of steps counted from the reset, never on the clock, so that the same run gives the same samples in
 * the page and in the build, at any speed.
 */

import { call, condition, curveEntry, plottable } from './piece.js'

const PER_WINDOW = 600 // samples in the width of a plot
const DEFAULT_WINDOW = 10 // s, for a plot that shows all of its time
const TRAIL = 2000 // points
const ENTRY = ['goal', 'expr']
const TOLERANCE = 1e-9 // s, of a goal

export class Sampler {
  /**
   * @param {Record<string, any>} config the lab's data
   * @param {Record<string, any>} code the lab's code
   * @param {number} site the id of the site whose trail is kept, or -1
   */
  constructor(config, code, site) {
    this.traces = config.plots.flatMap((plot, i) =>
      code.plots[i].map((run, j) => ({ entry: curveEntry(plot, i, j), run })),
    )
    const windows = config.plots.map((plot) => plot.window ?? DEFAULT_WINDOW)
    this.interval = Math.min(DEFAULT_WINDOW, ...windows) / PER_WINDOW
    this.site = site
    this.goal = config.goal ? new Goal(config.goal) : null
    this.holds = code.goal
    this.active = this.traces.length > 0 || site >= 0 || this.goal !== null
    this.trail = new Float32Array(site >= 0 ? 3 * TRAIL : 0)
    this.epoch = 0
    this.clear()
  }

  /** Begin a new run: drop the samples of the previous one. */
  clear() {
    this.epoch += 1
    this.times = []
    this.values = []
    this.points = 0
    this.first = 0 // of the points that are kept
    this.last = -Infinity
    this.from = Infinity
    this.goal?.clear()
  }

  /** Whether a sample is due after so many steps. */
  due(steps, timestep) {
    return this.active && steps % Math.max(1, Math.round(this.interval / timestep)) === 0
  }

  /** Add a sample; `env` is of data whose derived quantities are current. */
  record(env) {
    const { time } = env.data
    const values = this.traces.map(({ entry, run }) => call(entry, () => plottable(entry, run(env)) ?? NaN)) // all, before any is kept
    if (values.length > 0) this.times.push(time)
    this.values.push(...values)
    if (this.site >= 0) {
      const offset = 3 * (this.points++ % TRAIL)
      this.first = Math.max(this.first, this.points - TRAIL)
      const source = 3 * this.site
      this.trail.set(env.data.site_xpos.subarray(source, source + 3), offset)
    }
    if (this.goal !== null) this.goal.look(call(ENTRY, () => condition(ENTRY, this.holds(env))), time)
    this.last = time
  }

  /**
   * The samples since the last call. `values` holds, for each of the times, one value for each trace of all plots in turn;
   * a new `epoch` says that earlier samples belong to an earlier run, and those after the time `from` are no longer of this one.
   */
  take() {
    const { epoch, from } = this
    const samples = { epoch, from, times: Float64Array.from(this.times), values: Float64Array.from(this.values) }
    this.times = []
    this.values = []
    this.from = Infinity
    return samples
  }

  /** Forget the samples after a time (s). */
  cut(time) {
    const count = this.times.findLastIndex((at) => at <= time) + 1
    this.times.length = count
    this.values.length = count * this.traces.length
    this.from = Math.min(this.from, time)
    this.first = Math.min(this.first, this.points)
  }

  /** What was seen of the run so far, but for its samples. */
  read() {
    const { points, last, goal } = this
    return { points, last, goal: goal?.read() }
  }

  /** Go back or forward to what was seen at another moment. */
  write({ points, last, goal }) {
    this.points = points
    this.last = last
    this.goal?.write(goal)
  }

  /** Write the points of the trail, from the oldest to the newest, into `target` from `start` on; returns their number. */
  writeTrail(target, start) {
    const count = Math.max(0, this.points - this.first)
    for (let i = 0; i < count; i++) {
      const offset = 3 * ((this.first + i) % TRAIL)
      target.set(this.trail.subarray(offset, offset + 3), start + 3 * i)
    }
    return count
  }

  /** The most points that a trail has. */
  get capacity() {
    return this.trail.length / 3
  }
}

/** The goal of a lab: a condition that has to stay true for a while. It is looked at whenever a sample is taken. */
export class Goal {
  /** @param {{hold: number}} data s, for which it has to be true */
  constructor({ hold }) {
    this.hold = hold
    this.clear()
  }

  /** Begin a new run. */
  clear() {
    this.since = null // the time at which it last became true
    this.held = 0 // s, for which it has been true
    this.longest = 0 // s, the maximum of `held`
    this.reached = null // the time at which it had been true for long enough
  }

  /** How it stands. */
  read() {
    const { since, held, longest, reached } = this
    return { since, held, longest, reached }
  }

  /** Go to how it stood. */
  write(status) {
    Object.assign(this, status)
  }

  /** Note whether it is true at a time (s). */
  look(holds, time) {
    this.since = holds ? (this.since ?? time) : null
    this.held = holds ? time - this.since : 0
    this.longest = Math.max(this.longest, this.held)
    if (holds && this.held >= this.hold - TOLERANCE) this.reached ??= time
  }
}
