/**
 * Labs of kinds that a course brings: `content/labs/NAME.js` with `mount(element, config, api)`. docs/explanation/how-labs-run.md is its manual.
 */

import { buildControls, buildReadouts } from './controls.js'
import { h, prefersStillness } from './dom.js'
import { formatLabel, formatReadout, formatTime } from './numbers.js'
import { Plot } from './plots.js'
import { Hands } from './pointer.js'
import { Shell } from './shell.js'
import { Simulation } from './simulation.js'
import { buildTransport } from './transport.js'
import { View } from './view.js'

const HEIGHT = 240 // CSS pixels
const PLAIN_LAB = { controls: [], readouts: [], plots: [] }
const PLAIN_CONTROL = { type: 'slider', min: 0, max: 1 }

/**
 * Mount a lab with the course's own code.
 *
 * @returns {Promise<{dispose: () => void, restore?: (state: Record<string, any>) => void}>}
 */
export async function mountCustom(element, config, base, words) {
  const { mount } = await import(new URL(config.module, base).href)
  if (typeof mount !== 'function') throw new Error(`${config.kind}.js exports no function mount(element, config, api)`)
  const kit = new Kit(element, config, base, words)
  try {
    const mounted = (await mount(kit.body, config.data, kit.api())) ?? {}
    element.classList.add('lab-on')
    kit.finish()
    return {
      restore: mounted.restore,
      dispose() {
        mounted.dispose?.()
        kit.dispose()
      },
    }
  } catch (error) {
    kit.dispose()
    throw error
  }
}

/** Makes the `api` of a custom lab, and disposes at the end of what it has created. */
class Kit extends Shell {
  constructor(element, config, base, words) {
    super(element, config, words, null)
    this.base = base
    this.simulations = []
    this.disposals = []
    this.watchers = new Set()
    this.isVisible = false
    this.put(h('div', { class: 'lab-live' }), (visible) => {
      this.isVisible = visible
      this.simulations.forEach((simulation) => simulation.setVisible(visible))
      this.watchers.forEach((watcher) => watcher(visible))
    })
  }

  api() {
    const { words, notices } = this
    return Object.freeze({
      h,
      words,
      formatNumber: formatReadout,
      formatLabel,
      formatTime,
      createSimulation: (options) => this.createSimulation(options),
      createPlot: (config) => this.createPlot(config),
      createControls: (controls, actions) =>
        buildControls(
          controls.map((control) => ({ ...PLAIN_CONTROL, ...control })),
          actions,
        ),
      createReadouts: buildReadouts,
      createTransport: (actions) => buildTransport(words, { full: null, ...actions }),
      announce: (text) => notices.say(text),
      notice: (text, kind = /** @type {'note' | 'warning' | 'wrong'} */ ('note')) => (text === null ? notices.clear() : notices.show(text, kind)),
      onVisible: (watcher) => {
        this.watchers.add(watcher)
        watcher(this.isVisible)
        return () => this.watchers.delete(watcher)
      },
      prefersStillness,
    })
  }

  /**
   * Create a simulation in the page's worker.
   *
   * @param {Record<string, any>} [options] fields of a simlab (`controls`, `plots`, …), and `on` (see simulation.js), `picture` (false: none),
   *   `height` (px), `label` of the picture, `mjb` and `module` (addresses relative to the lab's JSON)
   */
  createSimulation(options = {}) {
    const { on = {}, picture = true, height = HEIGHT, label = this.config.title, ...fields } = options
    const { words, config } = this
    const number = this.simulations.length + 1
    const { worker, wasm, module, mjb } = config
    const lab = { ...PLAIN_LAB, worker, wasm, module, mjb, ...fields, id: `${config.id}/${number}`, kind: 'simlab' }
    lab.controls = lab.controls.map((control) => ({ ...PLAIN_CONTROL, ...control }))
    const name = words('lab.live.view', { title: label })
    const view = picture ? new View({ height, label: words('lab.live.picture', { title: label }), name, words }) : null
    const simulation = new Simulation({ config: lab, base: this.base, view, on: { ...this.faults(lab, view), ...on } })
    if (view !== null) {
      const keys = {
        ' ': () => (simulation.state === 'playing' ? simulation.pause() : simulation.play()),
        '.': () => simulation.step(),
        r: () => simulation.reset(),
      }
      const hands = new Hands(view, { pull: (request) => simulation.pull(request), keys })
      this.disposals.push(() => hands.dispose())
    }
    simulation.element = view === null ? null : h('div', { class: 'lab-screen' }, view.element)
    simulation.setVisible(this.isVisible)
    this.simulations.push(simulation)
    return simulation
  }

  createPlot(config) {
    const plot = new Plot(config, this.words)
    this.disposals.push(() => plot.dispose())
    return plot
  }

  /** After `mount`: append the notices, so that they stand last. */
  finish() {
    this.body.append(this.notices.message, this.notices.announcement)
  }

  dispose() {
    for (const simulation of this.simulations.splice(0)) simulation.dispose()
    for (const dispose of this.disposals.splice(0)) dispose()
    super.dispose()
  }
}
