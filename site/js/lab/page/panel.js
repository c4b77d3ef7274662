/**
 * What the model of a lab offers, in a folded panel: sliders of its actuators, values of its sensors, its cameras and keyframes, what MuJoCo
 * draws beside it, and the numbers of its bodies, joints and geoms.
 */

import { buildControls, buildReadouts } from './controls.js'
import { h } from './dom.js'
import { formatNumber } from './numbers.js'
import { Plot } from './plots.js'

const DIGITS = 3 // of sensors
const MOST_VALUES = 9 // of a sensor or a row that are shown; a matrix has as many
const INDENT = '\u2003' // of a part in the tree
const WINDOW = 10 // s, of its curve

export class ModelPanel {
  /**
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {Node | null} flags boxes for what MuJoCo draws
   * @param {{inspect: (on: boolean) => void, examine: (part: {kind: string, index: number} | null) => void, actuate: (index: number, value: number) => void, startAt: (index: number) => void,
   *   look: (camera: number) => void, seek: (time: number) => void}} actions `look`: through a camera of the model, or the free one
   *   (-1); `seek`: the reader points at a time (s) of a curve
   */
  constructor(words, flags, actions) {
    this.words = words
    this.flags = flags
    this.actions = actions
    this.curves = new Map() // the plots of sensors, by their numbers
    this.body = h('div', { class: 'lab-model' })
    this.element = h('details', { class: 'lab-help' }, h('summary', {}, words('lab.live.panel')), this.body)
    this.element.addEventListener('toggle', () => actions.inspect(this.element.open))
  }

  /** Show what there is. @param {any} model of core/panel.js; null: nothing any more */
  open(model) {
    if (model === null) return
    const { words, actions } = this
    const { actuators, sensors, cameras, keys, parts } = model
    this.closeCurves()
    let start = 0
    this.sensors = sensors.map(({ name, size }) => ({ name, start, end: (start += size) }))
    this.sliders = buildControls(
      actuators.map(({ name, min, max }) => ({ type: 'slider', label: name, min, max, step: null, digits: DIGITS })),
      { set: (i, value) => actions.actuate(i, Number(value)) },
    )
    this.readouts = buildReadouts(sensors.map(({ name }) => ({ label: name })))
    const views = [[words('lab.live.camera_free'), -1], ...cameras.map(({ name, index }) => [name, index])]
    const menu = buildControls([{ type: 'select', label: words('lab.live.camera'), options: views }], {
      set: (_, camera) => actions.look(Number(camera)),
    })
    const buttons = buildControls(
      keys.map((label) => ({ type: 'button', label })),
      { press: actions.startAt },
    )
    const tree = parts.map(({ kind, index, depth, name }) => [`${INDENT.repeat(depth)}${kind} ${name}`, { kind, index }])
    const chooser = buildControls([{ type: 'select', label: words('lab.live.part'), options: [['–', null], ...tree] }], {
      set: (_, part) => actions.examine(/** @type {{kind: string, index: number} | null} */ (part)),
    })
    this.rows = h('div')
    this.rowLabels = ''
    this.driven = h('p', { class: 'lab-driven', hidden: true }, words('lab.live.driven'))
    this.body.replaceChildren(
      ...this.section('actuators', actuators, this.sliders.element, this.driven),
      ...this.section('sensors', sensors, this.readouts.element, ...this.makeCurves(sensors)),
      ...this.section('keyframes', keys, buttons.element),
      ...(cameras.length > 0 ? [menu.element] : []),
      ...(this.flags === null ? [] : [this.flags]),
      chooser.element,
      this.rows,
    )
    actions.look(-1)
  }

  /** Boxes that draw the curves of sensors, and the place of these. */
  makeCurves(sensors) {
    const place = h('div')
    const boxes = sensors.map(({ name, size }, i) => {
      const box = h('input', { type: 'checkbox' })
      box.addEventListener('change', () => {
        if (!box.checked) return this.closeCurve(i)
        const count = Math.min(size, MOST_VALUES)
        const traces = Array.from({ length: count }, (_, j) => ({ label: size > 1 ? `[${j}]` : name }))
        const plot = new Plot({ ylabel: name, xlabel: this.words('lab.time'), window: WINDOW, traces }, this.words, this.actions.seek)
        this.curves.set(i, plot)
        place.append(plot.element)
      })
      return h('label', { class: 'lab-check' }, box, ` ${this.words('lab.live.sensor_curve', { name })}`)
    })
    return [h('div', { class: 'lab-overlays' }, ...boxes), place]
  }

  closeCurve(i) {
    const plot = this.curves.get(i)
    plot.dispose()
    plot.element.remove()
    this.curves.delete(i)
  }

  closeCurves() {
    for (const i of [...this.curves.keys()]) this.closeCurve(i)
  }

  /** Forget what came after a time (s) of the run. */
  cut(time) {
    for (const plot of this.curves.values()) plot.cut(time)
  }

  /** Draw the curves, with the values of a frame that is later than those before. @param {any} panel of the frame @param {any} now of Plot */
  draw(panel, now) {
    for (const [i, plot] of this.curves) {
      const { start, end } = this.sensors[i]
      const { length, last } = plot.whole
      if (panel !== null && (length === 0 || now.time > last)) plot.push([now.time], panel.sensors, end - start, start)
      plot.draw(now)
    }
  }

  /** The numbers of the chosen part, or for some frames yet of the one before. @param {[string, Float64Array][] | null} rows */
  showRows(rows) {
    const labels = (rows ?? []).map(([label]) => label).join()
    if (labels !== this.rowLabels) {
      this.rowLabels = labels
      this.rows.replaceChildren()
    }
    if (rows === null) return
    if (!this.rows.hasChildNodes()) {
      this.table = buildReadouts(rows.map(([label]) => ({ label })))
      this.rows.append(this.table.element)
    }
    this.table.show(rows.map(([, values]) => textOf(values, null)))
  }

  section(key, items, ...content) {
    if (items.length === 0) return []
    const label = this.words(`lab.live.${key}`)
    return [h('p', { 'aria-hidden': 'true', class: 'lab-kind' }, label), h('div', { role: 'group', 'aria-label': label }, ...content)]
  }

  /** Show the values of a frame. @param {{ctrl: Float64Array, sensors: Float64Array, driven: Uint8Array, rows: [string, Float64Array][] | null} | null} panel */
  show(panel) {
    if (panel === null || this.sensors === undefined) return
    const { ctrl, sensors, driven, rows } = panel
    this.showRows(rows)
    this.readouts.show(this.sensors.map(({ start, end }) => textOf(sensors.subarray(start, end))))
    this.sliders.show(Array.from(ctrl))
    this.driven.hidden = !driven.includes(1)
    this.sliders.element?.querySelectorAll('input').forEach((field, i) => (field.disabled = driven[i] === 1))
  }
}

/** The values of a sensor or a row; of a long one the first numbers. */
function textOf(values, digits = DIGITS) {
  const texts = Array.from(values.subarray(0, MOST_VALUES), (x) => formatNumber(x, digits))
  return values.length > MOST_VALUES ? `${texts.join(' ')} …` : texts.join(' ')
}
