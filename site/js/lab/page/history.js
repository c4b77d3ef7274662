/**
 * Samples of a plot, or poses of a picture: of a window of some seconds, or of the whole run.
 *
 * With a window, samples that have left it are dropped. Without one, every second sample is dropped whenever there are too many. No DOM.
 */

const MOST = 4000 // samples of a plot that shows all of its run

export class History {
  /** @param {number} traces how many values a sample has @param {number | null} window s; null: everything @param {number} [most] samples without one */
  constructor(traces, window, most = MOST) {
    this.traces = traces
    this.window = window
    this.most = most
    this.clear()
  }

  clear() {
    /** @type {number[][]} the times, then a column for each trace */
    this.columns = Array.from({ length: this.traces + 1 }, () => [])
    this.stride = 1
    this.counter = 0
  }

  get length() {
    return this.columns[0].length
  }

  /** The time of the last sample, or 0. */
  get last() {
    return this.columns[0].at(-1) ?? 0
  }

  /** Add a sample: its time, and the values from `offset` on. */
  push(time, values, offset) {
    if (this.counter++ % this.stride !== 0) return
    this.columns.forEach((column, i) => column.push(i === 0 ? time : values[offset + i - 1]))
    if (this.window === null) {
      if (this.length > this.most) this.thin()
      return
    }
    // One sample before the window stays, so that the line reaches its edge.
    const early = this.columns[0].findIndex((at) => at >= time - this.window) - 1
    if (early > 0) for (const column of this.columns) column.splice(0, early)
  }

  /** Drop the samples after a time (s); without any left, a new run begins. */
  cut(time) {
    const count = this.columns[0].findLastIndex((at) => at <= time) + 1
    for (const column of this.columns) column.length = count
    if (count === 0) this.clear()
  }

  thin() {
    this.columns = this.columns.map((column) => column.filter((_, i) => i % 2 === 0))
    this.stride *= 2
    this.counter = 1
  }

  /** Take the samples of another history from a time (s) on. */
  refill(other, from) {
    this.clear()
    other.columns[0].forEach((time, i) => {
      const sample = other.columns.map((column) => column[i])
      if (time >= from) this.push(time, sample, 1)
    })
  }

  /** The values at a time (s). @returns {number[]} */
  at(time) {
    const [times, ...columns] = this.columns
    return valuesAt(times, columns, time)
  }
}

/** The values of columns at a time, between two samples on a straight line. */
export function valuesAt(times, columns, time) {
  const i = Math.max(0, times.findLastIndex((x) => x <= time))
  const part = i + 1 < times.length ? Math.max(0, time - times[i]) / (times[i + 1] - times[i]) : 0
  return columns.map((column) => (part > 0 ? column[i] + part * (column[i + 1] - column[i]) : column[i]))
}
