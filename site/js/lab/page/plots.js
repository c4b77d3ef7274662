/**
 * Plots of a simulation, against time or another quantity. While the lab rests, a plot shows the whole run, pale outside its window.
 */

import { Chart } from './chart.js'
import { PLAYING, Samples } from './history.js'
import { formatTime } from './numbers.js'

const HEIGHT = 170 // CSS pixels where texts have their usual size
/** A plot of the lab's JSON with nothing in it. */
export const PLAIN_PLOT = {
  xlabel: '',
  ylabel: '',
  window: null,
  ymin: null,
  ymax: null,
  height: null,
  refLines: [],
  traces: [],
  log: false,
}

export class Plot extends Samples {
  /**
   * @param {any} config a plot of the lab's JSON; `log: true` gives it a logarithmic y axis; with an `x`, whose numbers come behind those
   *   of the traces, it is not against time
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {((time: number) => void) | null} [seek] the reader points at a time (s)
   */
  constructor(config, words, seek = null) {
    super(config, config.traces.length + (config.x ? 1 : 0))
    const format = (time) => `${formatTime(time)} s`
    this.chart = new Chart(config, { words, across: words('lab.time'), height: HEIGHT, format, seek })
    this.element = this.chart.element
    this.element.classList.add('lab-plot')
    this.dirty = true
    this.draw()
  }

  /**
   * Draw what is new.
   *
   * @param {{time: number, resting: boolean, marks: {time: number, label: string}[]}} [now] the time of the lab (s), whether it rests,
   *   and when which control was used
   */
  draw(now = PLAYING) {
    if (!this.take(now)) return
    this.dirty = false
    const { config, kept, history } = this
    const { time, resting, marks } = now
    const curves = (columns) => {
      const [times, ...traces] = columns
      return { times, x: config.x ? traces.pop() : times, traces }
    }
    this.chart.draw({
      ...curves(history.columns),
      ghost: kept && curves(kept),
      across: config.x ? null : this.timeRange(),
      at: resting ? time : Infinity,
      from: resting ? time - (config.window ?? Infinity) : undefined,
      pale: resting,
      marks,
    })
  }

  timeRange() {
    const { window } = this.config
    const { last } = this.history
    if (window === null || this.now.resting) return [0, Math.max(window ?? 1, last, this.kept?.[0].at(-1) ?? 0)]
    return last <= window ? [0, window] : [last - window, last]
  }

  dispose() {
    this.chart.dispose()
  }
}
