/**
 * Records a lab while it runs: the traces of its plots, the trail of a site, and how long its goal has held.
 *
 * Samples lie on a grid of steps counted from the reset, never on the clock, so that the same run gives the same samples in
 * the page and in the build, at any speed.
 */

import { Goal } from './goal.js'
import { call, plottable } from './piece.js'

const PER_WINDOW = 600 // samples in the width of a plot
const DEFAULT_WINDOW = 10 // s, for a plot that shows all of its time
const TRAIL = 2000 // points

export class Sampler {
  /**
   * @param {Record<string, any>} config the lab's data
   * @param {Record<string, any>} code the lab's code
   * @param {number} site the id of the site whose trail is kept, or -1
   */
  constructor(config, code, site) {
    this.traces = config.plots.flatMap((plot, i) =>
      plot.traces.map((_, j) => ({ entry: ['plots', i, 'traces', j, 'expr'], run: code.plots[i][j] })),
    )
    const windows = config.plots.map((plot) => plot.window ?? DEFAULT_WINDOW)
    this.interval = Math.min(DEFAULT_WINDOW, ...windows) / PER_WINDOW
    this.site = site
    this.goal = config.goal ? new Goal(config.goal, code.goal) : null
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
    this.last = -Infinity
    this.goal?.clear()
  }

  /** Whether a sample is due after so many steps. */
  due(steps, timestep) {
    return this.active && steps % Math.max(1, Math.round(this.interval / timestep)) === 0
  }

  /** The traces, evaluated now; a gap is NaN. */
  evaluate(env) {
    return Float64Array.from(this.traces, ({ entry, run }) => call(entry, () => plottable(entry, run(env)) ?? NaN))
  }

  /** Add a sample; `env` is of data whose derived quantities are current. */
  record(env) {
    if (this.traces.length > 0) {
      this.values.push(...this.evaluate(env))
      this.times.push(env.data.time)
    }
    if (this.site >= 0) {
      const offset = 3 * (this.points++ % TRAIL)
      const source = 3 * this.site
      this.trail.set(env.data.site_xpos.subarray(source, source + 3), offset)
    }
    this.goal?.look(env)
    this.last = env.data.time
  }

  /**
   * The samples since the last call. `values` holds, for each of the times, one value for each trace of all plots in turn;
   * a new `epoch` says that earlier samples belong to an earlier run.
   */
  take() {
    const samples = { epoch: this.epoch, times: Float64Array.from(this.times), values: Float64Array.from(this.values) }
    this.times = []
    this.values = []
    return samples
  }

  /** Write the points of the trail, from the oldest to the newest, into `target` from `start` on; returns their number. */
  writeTrail(target, start) {
    const count = Math.min(this.points, TRAIL)
    const oldest = this.points > TRAIL ? 3 * (this.points % TRAIL) : 0
    target.set(this.trail.subarray(oldest, 3 * count), start)
    target.set(this.trail.subarray(0, oldest), start + 3 * count - oldest)
    return count
  }

  /** The most points that a trail has. */
  get capacity() {
    return this.trail.length / 3
  }
}
