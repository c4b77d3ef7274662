/** A plot of one quantity against another, while a lab runs: the samples of a run, drawn as the curves of labs without an engine are. */

import { Chart } from './chart.js'
import { Samples } from './history.js'
import { HEIGHT } from './plots.js'

export class Orbit extends Samples {
  /** @param {any} config a plot of the lab's JSON with an `x`, whose numbers come behind those of the traces */
  constructor(config, words) {
    super(config, config.traces.length + 1)
    const { ylabel, xlabel, height } = config
    const caption = words('lab.plot', { ylabel: ylabel || words('lab.value'), xlabel })
    const options = { axis: {}, caption, height: height ?? HEIGHT, seek: () => {}, direction: () => [] }
    this.chart = new Chart(config, options)
    this.element = this.chart.element
    this.element.classList.add('lab-plot')
  }

  draw(now) {
    if (!this.take(now)) return
    this.dirty = false
    const [times, ...columns] = this.history.table()
    const curves = ([, ...parts]) => ({ x: parts.at(-1), traces: parts.slice(0, -1) })
    const count = now.resting ? times.findLastIndex((time) => time <= now.time) + 1 : times.length
    const { x, traces } = curves([times, ...columns])
    this.chart.set({ x, traces }, this.kept && curves(this.kept))
    this.chart.show(count, { x: x[count - 1], values: traces.map((column) => column[count - 1]) })
  }

  dispose() {
    this.chart.dispose()
  }
}
