/**
 * A lab without an engine: its plots, transport, controls and readouts.
 *
 *   const desk = new Desk(element, config, words, progress)
 *
 * Everything that it shows follows from the values of the controls and the place on the axis, which the reader moves or plays.
 */

import { Curves } from '../core/curves.js'
import { Chart } from './chart.js'
import { buildControls, buildReadouts } from './controls.js'
import { h } from './dom.js'
import { formatNumber, withUnit } from './numbers.js'
import { Shell } from './shell.js'
import { buildTransport } from './transport.js'

const NATURAL = [2, 60] // s: a run of such a length plays in real time
const LENGTH = 8 // s, of any other
const LONGEST_FRAME = 0.1 // s

export class Desk extends Shell {
  constructor(element, config, words, progress) {
    super(element, config, words, progress)
    this.curves = new Curves(config)
    this.initial = config.controls.map(({ value }) => value)
    this.values = this.initial
    this.first = null // the samples of the start
    this.place = config.axis.at
    this.speed = 1
    this.state = 'paused'
    this.visible = false
    const { min, max } = config.axis
    const isNatural = config.kind === 'ode' && max - min >= NATURAL[0] && max - min <= NATURAL[1]
    this.rate = isNatural && !config.play ? 1 : (max - min) / (config.play ?? LENGTH)
    this.unit = withUnit('', config.axis.unit)
    this.digits = Math.min(10, Math.max(0, 3 - Math.ceil(Math.log10(max - min))))
    this.tick = (now) => this.advance(now)
    this.build()
    this.compute()
  }

  build() {
    const { config, words } = this
    const { axis } = config
    this.charts = config.plots.map(
      (plot, i) =>
        new Chart(plot, {
          words,
          across: axis.name,
          height: config.height,
          format: (x) => this.textOf(x),
          seek: (x) => this.seek(x),
          direction: ([x, y]) => this.result.direction(this.place, plot.field, x, y),
        }),
    )
    this.transport = buildTransport(words, {
      play: () => this.togglePlay(),
      step: () => this.step(),
      reset: () => this.reset(),
      speed: (factor) => (this.speed = factor),
      full: this.full,
    })
    const label = words('lab.live.cursor')
    const range = { min: String(axis.min), max: String(axis.max), step: String((axis.max - axis.min) / 600) }
    const oninput = () => this.seek(Number(this.slider.value))
    this.slider = h('input', { type: 'range', class: 'lab-scrub', 'aria-label': label, title: label, ...range, oninput })
    this.controls = buildControls(config.controls, { set: (index, value) => this.set(index, value) })
    this.readouts = buildReadouts(config.readouts)
    this.goal = this.makeGoal({
      show: () => this.begin(config.goal.values),
      unit: this.unit,
      format: (x) => formatNumber(x, this.digits).trim(),
    })
    const onkeydown = (event) => this.onKey(event)
    const charts = h('div', { class: 'lab-charts', role: 'group', tabIndex: 0, onkeydown }, ...this.charts.map((chart) => chart.element))
    charts.setAttribute('aria-label', words('lab.live.curve', { caption: this.charts.map(({ caption }) => caption).join('; ') }))
    const link = () => this.share({ values: this.values, steps: 0, time: this.place, physics: new Float64Array() })
    const foot = h('div', { class: 'lab-foot' }, this.makeButton('link', link), this.makeHelp(['keys_curve']))
    const panel = h('div', { class: 'lab-panel' }, this.controls.element, this.readouts.element)
    this.show(
      'lab-live lab-desk',
      [h('div', { class: 'lab-screen' }, charts, this.transport.full), this.slider, this.transport.element],
      [this.goal?.element ?? null, panel, this.notices.message], // below what the reader holds
      foot,
      (isVisible) => {
        this.visible = isVisible
        this.schedule()
      },
    )
    this.setState('paused')
  }

  // --- what is shown

  /** Compute what follows from the controls. */
  compute() {
    const { curves, values, initial, notices, words } = this
    this.result = curves.run(values)
    this.samples = this.result.samples()
    this.first ??= this.samples
    this.ghost = values === initial || this.first === this.samples ? null : this.first
    this.controls.show(values)
    if (this.result.failure !== null) {
      const { kind } = this.result.failure
      const reason = words(`lab.live.ended_${kind === 'blowup' ? 'value' : kind}`)
      notices.show(words('lab.live.ended', { place: this.textOf(this.result.end), reason }), 'warning')
    } else notices.clear()
    this.showPlace()
  }

  /** Show the place on the axis, and all that belongs to it. */
  showPlace() {
    const { config, curves, result: run, samples } = this
    const x = (this.place = Math.min(Math.max(this.place, run.start), run.end))
    const { min, max } = config.axis
    this.charts.forEach((chart, i) =>
      chart.draw({
        ...samples.plots[i],
        times: samples.times,
        ghost: this.ghost?.plots[i] ?? null,
        across: curves.plots[i].x ? null : [min, max],
        at: x,
        to: config.kind === 'ode' ? x : Infinity,
      }),
    )
    this.readouts.show(run.readouts(x))
    const text = this.textOf(x)
    this.slider.value = String(x)
    this.slider.setAttribute('aria-valuetext', text)
    this.transport.setText(`${config.axis.name} = ${text}`)
    if (this.goal === null) return
    const at = samples.times.findLastIndex((time) => time <= x)
    const reached = samples.reached !== null && samples.reached <= x ? samples.reached : null
    this.goal.show({ held: samples.held[at] ?? 0, reached, counts: true })
  }

  /** A place on the axis with its unit. */
  textOf(x) {
    return `${formatNumber(x, this.digits).trim()}${this.unit}`
  }

  // --- actions of the reader

  set(index, value) {
    this.values = this.values.map((before, i) => (i === index ? value : before))
    const wasAtEnd = this.place >= this.result.end
    // Before the first motion nothing would be seen of the change.
    const isFresh = this.state === 'paused' && this.place <= this.result.start
    this.compute()
    if (this.config.kind === 'ode' && (wasAtEnd || isFresh)) this.seek(this.result.end)
  }

  seek(x) {
    this.place = x
    this.showPlace()
  }

  togglePlay() {
    if (this.state === 'playing') return this.pause()
    if (this.place >= this.result.end) this.place = this.result.start
    this.setState('playing')
    this.notices.say(this.words('lab.live.said_playing'))
    this.last = null
    this.schedule()
  }

  pause() {
    this.setState('paused')
    this.notices.say(this.words('lab.live.said_paused', { t: this.textOf(this.place) }))
  }

  setState(state) {
    this.state = state
    this.element.dataset.state = state
    this.transport.setPlaying(state === 'playing')
  }

  schedule() {
    if (this.state === 'playing' && this.visible) requestAnimationFrame(this.tick)
  }

  advance(now) {
    if (this.state !== 'playing' || !this.visible) return
    const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, LONGEST_FRAME)
    this.last = now
    this.seek(this.place + passed * this.rate * this.speed)
    if (this.place >= this.result.end) this.pause()
    else this.schedule()
  }

  /** Move by one sample, forwards or back. */
  step(count = 1) {
    if (this.state === 'playing') this.pause()
    this.seek(this.place + (count * (this.config.axis.max - this.config.axis.min)) / 600)
  }

  reset() {
    this.setState('paused')
    this.values = this.initial
    this.first = null // the samples of the start
    this.place = this.config.axis.at
    this.compute()
    this.notices.say(this.words('lab.live.said_reset'))
  }

  /** Play from the start, with these values of the controls. */
  begin(values) {
    this.values = values
    this.compute()
    this.place = this.result.start
    if (this.state !== 'playing') this.togglePlay()
  }

  /** Set the controls that `steps` lists by their labels, and play. */
  run(steps) {
    const labels = this.config.controls.map(({ label }) => label)
    const set = Object.assign({}, ...steps.filter((step) => typeof step === 'object'))
    this.begin(this.initial.map((value, i) => set[labels[i]] ?? value))
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return
    const act = {
      ' ': () => this.togglePlay(),
      '.': () => this.step(),
      r: () => this.reset(),
      ArrowRight: () => this.step(event.shiftKey ? 20 : 4),
      ArrowLeft: () => this.step(event.shiftKey ? -20 : -4),
      Home: () => this.seek(this.result.start),
      End: () => this.seek(this.result.end),
    }[event.key]
    if (act === undefined) return
    event.preventDefault()
    act()
  }

  /** Go to the state of a link. */
  restore({ values, time }) {
    if (values.length !== this.initial.length || !values.every(Number.isFinite)) return
    this.values = values
    this.place = time
    this.compute()
  }

  dispose() {
    this.setState('paused')
    this.charts.forEach((chart) => chart.dispose())
    super.dispose()
  }
}
