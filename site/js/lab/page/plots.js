/**
 * Plots of a simulation, against time or another quantity. While the lab rests, a plot shows the whole run, pale outside its window.
 */

import { Chart } from './chart.js'
import { History } from './history.js'
import { formatTime } from './numbers.js'

const HEIGHT = 170 // CSS pixels where texts have their usual size
const PLAYING = { time: 0, resting: false, marks: [] }

export class Plot {
  /**
   * @param {any} config a plot of the lab's JSON; `log: true` gives it a logarithmic y axis; with an `x`, whose numbers come behind those
   *   of the traces, it is not against time
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {((time: number) => void) | null} [seek] the reader points at a time (s)
   */
  constructor(config, words, seek = null) {
    const { traces, window = null, x } = config
    this.config = config
    this.count = traces.length + (x ? 1 : 0) // numbers of a sample
    this.recent = new History(this.count, window)
    this.whole = window === null ? this.recent : new History(this.count, null)
    /** @type {{time: number, resting: boolean, marks: {time: number, label: string}[]}} */
    this.now = PLAYING
    /** @type {{plot: Plot, column: number, label: string} | null} the curve against which the reader wants this drawn */
    this.axis = null
    /** @type {number[][] | null} the samples of an earlier run */
    this.kept = null
    this.dirty = true
    const format = (time) => `${formatTime(time)} s`
    this.chart = new Chart(config, { words, across: words('lab.time'), height: HEIGHT, format, seek })
    this.element = this.chart.element
    this.element.classList.add('lab-plot')
    this.draw()
  }

  /** Add samples: `values` has `width` numbers for each time, those of this plot from `offset` on. */
  push(times, values, width, offset) {
    for (const history of new Set([this.recent, this.whole])) {
      for (let i = 0; i < times.length; i++) history.push(times[i], values, i * width + offset)
    }
    if (times.length > 0) this.dirty = true
  }

  clear() {
    this.cut(-Infinity)
  }

  /** Drop what came after a time (s). */
  cut(time) {
    const { recent, whole, config } = this
    whole.cut(time)
    if (recent !== whole) recent.refill(whole, time - config.window)
    this.dirty = true
  }

  /** Keep the run, so that its lines stay behind those of the next; or keep none. */
  keep(on) {
    this.kept = on && this.whole.length > 0 ? this.whole.columns.map((column) => column.slice()) : null
    this.dirty = true
  }

  /** Draw against a curve of this plot or of one with the same times, or null: as the config says. @param {Plot['axis']} axis */
  over(axis) {
    this.axis = axis
    this.chart.name(axis === null ? this.config : { ...this.config, xlabel: axis.label, xmin: null, xmax: null, points: null })
    this.dirty = true
  }

  /**
   * Draw what is new.
   *
   * @param {{time: number, resting: boolean, marks: {time: number, label: string}[]}} [now] the time of the lab (s), whether it rests,
   *   and when which control was used
   */
  draw(now = PLAYING) {
    const before = this.now
    this.now = now
    const { time, resting, marks } = now
    if (!this.dirty && resting === before.resting && (!resting || time === before.time)) return
    this.dirty = false
    const { config, kept, axis } = this
    const history = resting || axis ? this.whole : this.recent
    const curves = (columns, others) => {
      const [times, ...traces] = columns
      const x = config.x ? traces.pop() : times
      return { times, x: axis ? others[axis.column] : x, traces }
    }
    this.chart.draw({
      ...curves(history.columns, axis?.plot.whole.columns),
      ghost: kept && curves(kept, axis?.plot.kept),
      across: config.x || axis ? null : this.timeRange(history.last),
      at: resting ? time : Infinity,
      from: resting ? time - (config.window ?? Infinity) : undefined,
      pale: resting,
      marks,
    })
  }

  timeRange(last) {
    const { window = null } = this.config
    if (window === null || this.now.resting) return [0, Math.max(window ?? 1, last, this.kept?.[0].at(-1) ?? 0)]
    return last <= window ? [0, window] : [last - window, last]
  }

  dispose() {
    this.chart.dispose()
  }
}
