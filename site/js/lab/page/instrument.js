/**
 * A `simlab` as an instrument: picture, transport, controls, readouts and plots.
 *
 *   const instrument = new Instrument(element, config, base, words, progress, openEditor)
 *
 * `element` is the lab's place in the page, `config` its JSON, `base` the address of that JSON, to which its addresses are relative;
 * `progress` stores a reached goal (progress/store.js), or is null; `openEditor` is that of workbench.js, which needs this module.
 */

import { copyText } from '../../page/copy.js'
import { buildControls, buildOverlays, buildReadouts, switchButton } from './controls.js'
import { download, h, icon, textButton } from './dom.js'
import { curvesText, fillScript, nameOf } from './export.js'
import { History } from './history.js'
import { digitsOfStep, formatTime } from './numbers.js'
import { followLegend } from './legend.js'
import { ModelPanel } from './panel.js'
import { Plot } from './plots.js'
import { Hands } from './pointer.js'
import { writeLog } from './share.js'
import { Shell } from './shell.js'
import { Simulation } from './simulation.js'
import { buildTape, buildTransport } from './transport.js'
import { View } from './view.js'
import { ROW } from './world.js'

const TEXT_EVERY = 90 // ms; nobody reads numbers faster
const PLOT_EVERY = 30
const SETTLE_TIME = 400 // ms, after which the last picture of a paused lab has arrived
const HEIGHT = 300 // CSS pixels, of a view that is 480 wide
const MOST_NUMBERS = 500_000 // in all poses of a run, 4 MB
const FLAGS = ['frames', 'joints', 'com', 'inertia', 'contacts', 'forces'] // overlays that any model has
const HELP = ['keys_mouse', 'keys_touch', 'keys_camera', 'keys_run']

export class Instrument extends Shell {
  constructor(element, config, base, words, progress = null, openEditor = null) {
    super(element, config, words, progress)
    this.base = base
    this.openEditor = openEditor
    /** @type {import('./editor.js').Editor | null} */
    this.editor = null // of what the reader writes, in those that have one
    this.bench = null // in which the reader edits the model, in place of this
    this.values = this.initial = config.controls.map(({ value }) => value ?? null)
    this.textAt = this.plotAt = -Infinity
    this.sayTimer = 0 // of the announcement of a pause
    this.starter = config.controls.findIndex(({ label }) => config.start && label === config.start) // the button that Play presses
    this.playRequested = false
    this.hasStarted = false // whether it has played, or the reader has stepped
    /** @type {History | null} the poses of the run, as its pictures showed them */
    this.poses = null
    this.keptPoses = null
    this.build()
    this.simulation = new Simulation({ config, base, view: this.view, on: this.listeners() })
    this.leaveLegend = followLegend(element, (name, isAsked) => this.simulation.point(name, isAsked))
  }

  build() {
    const { config, words, element } = this
    const title = config.title || words('lab.untitled')
    this.view = new View({
      height: config.height ?? HEIGHT,
      label: words('lab.live.picture', { title }),
      name: words('lab.live.view', { title }),
      words,
      poster: element.querySelector('.lab-static img'),
    })
    this.hands = new Hands(this.view, {
      pull: (request) => this.simulation.pull(request),
      keys: { ' ': () => this.togglePlay(), '.': () => this.step(1), ',': () => this.step(-1), r: () => this.reset() },
    })
    this.hands.grabs = Boolean(config.grab)
    this.transport = buildTransport(words, {
      play: () => this.togglePlay(),
      step: null,
      reset: () => this.reset(),
      speed: (factor) => this.simulation.speed(factor),
      full: this.full,
    })
    const seek = (time) => this.simulation.seek(time)
    this.tape = buildTape(words, config.stopAt, { seek, step: (count) => this.step(count) })
    this.controls = buildControls(config.controls, {
      set: (index, value) => this.simulation.set(index, value, !this.hasStarted),
      press: (index) => this.simulation.press(index, config.controls[index].play),
    })
    const overlay = (name, isOn) => this.simulation.overlay(name, isOn)
    const isEdited = config.kind === 'mjcf' // then the picture has all of the width, and what can be drawn stands in the panel
    const { arrows, boxes } = buildOverlays({ ...config, toggles: isEdited ? [] : config.toggles }, words, overlay)
    if (arrows !== null) this.transport.speed.after(arrows)
    const grab = switchButton(icon('hand'), 'lab-icon', words('lab.live.grab'), this.hands.grabs, (isOn) => (this.hands.grabs = isOn))
    this.transport.speed.after(grab)
    this.readouts = buildReadouts(config.readouts)
    const others = isEdited ? new Set([...FLAGS, ...config.toggles]) : FLAGS.filter((name) => !config.toggles.includes(name))
    const toggles = [...others].filter((name) => !config.arrows?.[name])
    const flags = buildOverlays({ toggles, overlays: config.overlays, arrows: null }, words, overlay).boxes
    this.panel = new ModelPanel(words, flags, {
      inspect: (on) => this.simulation.inspect(on),
      examine: (part) => this.simulation.examine(part),
      actuate: (index, value) => this.simulation.actuate(index, value, !this.hasStarted),
      startAt: (index) => this.simulation.startAt(index),
      look: (camera) => this.view.look(camera),
      seek,
    })
    this.plots = config.plots.map((plot) => new Plot(plot, words, seek))
    this.goal = this.makeGoal({ show: () => this.simulation.replay({ values: this.initial, events: config.goal.log }) })
    this.motion = h('p', { class: 'lab-motion', hidden: true })
    this.controls.show(this.values)
    this.transport.setTime(0)
    const screen = h('div', { class: 'lab-screen' }, this.view.element, this.transport.full, this.notices.message)
    const panel = h('div', { class: 'lab-panel' }, this.controls.element, boxes, this.readouts.element)
    const plots = this.plots.map((plot) => plot.element)
    this.reason = h('p', { class: 'lab-reason', hidden: !config.still }, config.still) // why nothing moves when a reader presses Play
    this.show(
      'lab-live',
      [screen, this.transport.element, this.tape.element, this.reason],
      [this.motion, this.goal?.element ?? null, ...plots, panel],
      this.makeFoot(),
      (isVisible) => this.simulation.setVisible(isVisible),
    )
  }

  /** Link, export and help under the instrument. */
  makeFoot() {
    const { config } = this
    const script = config.exportPython
    const act = (key, run) => this.makeButton(key, run)
    return h(
      'div',
      { class: 'lab-foot' },
      act(...this.shareAction()),
      ...(this.plots.length > 0 ? [this.makeKeepButton(), act('csv', () => this.exportCurves()), this.makeAxisMenu()] : []),
      script ? act('export', () => download(script.name, fillScript(script.text, this.values), 'text/x-python')) : null,
      document.querySelector('script[data-state]') && !config.kind ? this.makeLogButton() : null,
      config.source && this.openEditor ? act('edit', () => this.edit()) : null,
      this.panel.element,
      this.makeHelp(HELP),
    )
  }

  /** A button that keeps the run, as a ghost in the picture and behind the curves of the next ones, and then one that drops it. */
  makeKeepButton() {
    let isKept = false
    const button = this.makeButton('keep', () => {
      isKept = !isKept
      button.textContent = this.words(isKept ? 'lab.live.drop' : 'lab.live.keep')
      this.keptPoses = isKept && (this.poses?.length ?? 0) > 0 ? this.makePoses() : null
      this.keptPoses?.refill(this.poses, -Infinity)
      this.haunt()
      this.redraw((plot) => plot.keep(isKept))
    })
    return button
  }

  /** A menu of what the curves are drawn against: the time, or one of them; null for a single one. */
  makeAxisMenu() {
    const { plots, words } = this
    const axes = plots.flatMap((plot) => plot.config.traces.map(({ label }, i) => ({ plot, column: 1 + i, label: nameOf(label, plot.config.ylabel) })))
    if (axes.length === 1) return null
    const options = [[words('lab.time'), null], ...axes.map((axis) => [axis.label, axis])]
    const set = (_, axis) => this.redraw((plot) => plot.over(axis))
    return buildControls([{ type: 'select', label: words('lab.live.over'), options }], { set }).element
  }

  /** Change each plot, and draw it anew. */
  redraw(change) {
    for (const plot of this.plots) {
      change(plot)
      plot.draw(plot.now)
    }
  }

  // --- events of the simulation

  listeners() {
    const { words, notices } = this
    return {
      ...this.faults(this.config, this.view),
      state: (state, reason) => this.onStateChange(state, reason),
      ready: (message) => this.onReady(message),
      model: (model) => this.panel.open(model),
      samples: (samples, fresh) => this.collect(samples, fresh),
      refresh: (frame, now) => this.refresh(frame, now),
      controls: (values) => {
        notices.clear()
        this.update(values)
      },
      warning: ({ time, message }) => notices.show(words('lab.live.warning', { t: formatTime(time), message }), 'warning'),
      error: (error) => {
        if (this.editor === null || error.kind !== 'load') return notices.failure(error, this.config)
        this.editor.fail(error.message)
        this.playRequested = false
      },
      saved: (state) => this.onSaved(state),
    }
  }

  onReady({ values, scene }) {
    this.digits = Math.min(4, Math.max(2, digitsOfStep(scene.timestep))) // of the time at rest, so that a step is seen
    this.poses = this.makePoses()
    const said = scene.coarse.length > 0 ? this.words('lab.live.coarse', { names: scene.coarse.join(', ') }) : ''
    this.reason.textContent = [this.config.still, said].filter(Boolean).join(' ')
    this.reason.hidden = this.reason.textContent === ''
    this.update(values)
    const { playRequested: pressed } = this
    this.playRequested = false
    if (pressed) this.begin()
  }

  onStateChange(state, reason) {
    this.state = state
    this.element.dataset.state = state
    this.textAt = this.plotAt = -Infinity // so that the next refresh shows the numbers of the last picture
    this.showPlay(state === 'playing')
    const isReady = state !== 'loading' && state !== 'ended'
    this.transport.setEnabled(isReady)
    this.tape.setEnabled(isReady)
    this.controls.setEnabled(state !== 'ended')
    if (state === 'playing') {
      this.hasStarted = true
      this.notices.clear()
      this.notices.say(this.words('lab.live.said_playing'))
    }
    clearTimeout(this.sayTimer)
    const key = { user: 'said_paused', code: 'said_paused', stopAt: 'said_stopped' }[reason]
    if (key) this.sayTimer = setTimeout(() => this.sayTime(key), SETTLE_TIME)
  }

  sayTime(key) {
    this.notices.say(this.words(`lab.live.${key}`, { t: `${formatTime(this.simulation.latest?.time ?? 0)} s` }))
  }

  /** Room for the poses of a run; null without a picture. */
  makePoses() {
    const { world } = this.view
    if (world === null) return null
    const length = ROW * world.geoms.length
    return new History(length, null, Math.ceil(MOST_NUMBERS / length))
  }

  /** Show where the kept run was at the time that is shown. */
  haunt() {
    this.view.ghost = this.keptPoses?.at(this.simulation.latest.time) ?? null
    this.view.invalidate()
  }

  collect({ times, values, from }, fresh) {
    const end = fresh ? -Infinity : from
    if (end < Infinity) for (const record of [this.poses, this.panel, ...this.plots]) record?.cut(end)
    const { poses, view } = this
    const { time } = this.simulation.latest
    if (poses !== null && (poses.length === 0 || time > poses.last)) poses.push(time, view.world.pose(view.frame), 0)
    this.haunt()
    const width = times.length > 0 ? values.length / times.length : 0
    let offset = 0
    for (const plot of this.plots) {
      plot.push(times, values, width, offset)
      offset += plot.count
    }
  }

  /** Update numbers and plots, less often than the picture. */
  refresh({ time, readouts, realtime, goal, panel, tape }, now) {
    const resting = this.state !== 'playing'
    const marks = tape.marks.map(([at, i]) => ({ time: at, label: this.config.controls[i].label }))
    if (resting || now - this.textAt >= TEXT_EVERY) {
      this.goal?.show(goal)
      this.textAt = now
      if (readouts !== null) this.readouts.show(readouts)
      this.panel.show(panel)
      this.transport.setTime(time, resting ? this.digits : undefined)
      const touches = tape.touches.map((at) => ({ time: at, label: this.words('lab.live.touch') }))
      this.tape.show(tape, time, [...marks, ...touches])
      this.showPlay(!resting)
      this.transport.setRatio(resting ? 1 : realtime, resting ? Infinity : this.view.rate)
    }
    if (resting || now - this.plotAt >= PLOT_EVERY) {
      this.plotAt = now
      this.plots.forEach((plot) => plot.draw({ time, resting, marks }))
      this.panel.draw(panel, { time, resting, marks })
    }
  }

  update(values) {
    this.values = values
    this.controls.show(values)
  }

  // --- actions of the reader

  togglePlay() {
    if (this.state === 'playing') this.simulation.pause()
    else if (this.state === 'loading' || this.state === 'asleep') {
      this.playRequested = !this.playRequested
      this.simulation.wake()
      this.showPlay(this.playRequested)
    } else {
      this.notices.clear()
      this.begin()
    }
  }

  get isAtStart() {
    return (this.simulation?.latest?.time ?? 0) === 0
  }

  /** Play; at the start, press the button that begins the motion. */
  begin() {
    if (this.starter >= 0 && this.isAtStart) this.simulation.press(this.starter, true)
    else this.simulation.play()
  }

  showPlay(isPlaying) {
    this.transport.setPlaying(isPlaying, this.starter >= 0 && this.isAtStart ? this.config.start : undefined)
  }

  step(count) {
    this.hasStarted = true
    this.simulation.step(count)
  }

  reset() {
    this.simulation.reset()
    clearTimeout(this.sayTimer)
    this.notices.say(this.words('lab.live.said_reset'))
  }

  /** Go to the state of a link, and offer a button that replays the motion that led to it. */
  restore(state) {
    const { log } = state
    if (state.text !== undefined && this.config.source && this.openEditor) return void this.edit(state)
    const replay = () => this.simulation.replay(log)
    const button = textButton(this.words('lab.live.motion'), replay)
    this.motion.replaceChildren(button)
    this.motion.hidden = !log
    this.leaveEditor()
    this.simulation.restore(state)
  }

  /** Reset the controls, then press the buttons and set the controls that `steps` lists by their labels, and play. */
  run(steps) {
    const { simulation, config } = this
    const control = (label) => config.controls.findIndex((item) => item.label === label)
    this.leaveEditor()
    simulation.restore({ values: config.controls.map(({ value }) => value ?? null) })
    if (steps.length === 0) simulation.play()
    for (const step of steps) {
      if (typeof step === 'string') simulation.press(control(step), config.controls[control(step)].play)
      else for (const [label, value] of Object.entries(step)) simulation.set(control(label), value, true)
    }
  }

  /** Let the reader edit the model, in place of this lab. @param {Record<string, any> | null} [state] of a link to an edited model */
  async edit(state = null) {
    try {
      const text = await this.fetchText(this.config.source)
      if (this.state === 'playing') this.simulation.pause()
      this.body.hidden = true
      this.bench = this.openEditor(this, text.trimEnd(), () => this.leaveEditor())
      if (state !== null) this.bench.restore(state)
    } catch (error) {
      this.notices.show(error.message, 'warning')
    }
  }

  /** The text at an address of the lab's JSON. */
  async fetchText(address) {
    const response = await fetch(new URL(address, this.base))
    if (!response.ok) throw new Error(this.words('lab.live.not_found', { status: response.status }))
    return response.text()
  }

  leaveEditor() {
    if (this.bench === null) return
    this.bench.dispose()
    this.bench = null
    this.body.hidden = false
    this.element.classList.add('lab-on')
    this.element.dataset.state = this.state
    this.view.invalidate()
    this.view.element.focus({ preventScroll: true })
  }

  /** The label (a key) and the action of the button for a link. */
  shareAction() {
    return ['link', () => this.save((state) => this.share(state))]
  }

  /** Ask for the state; `callback` is called with it. */
  save(callback) {
    this.onSaved = callback
    this.simulation.save()
  }

  /** For the preview: a button that copies what the author has done, as the `log` of a goal. */
  makeLogButton() {
    const copy = async ({ log }) => {
      const text = log ? writeLog(log, this.config.controls) : ''
      if (text && (await copyText(text))) this.notices.show(this.words('lab.live.log_copied'), 'note')
      else this.notices.show(text || this.words('lab.live.no_log'), 'warning')
    }
    return this.makeButton('copy_log', () => this.save(copy))
  }

  exportCurves() {
    const curves = this.plots.map(({ config, whole }) => ({
      ylabel: config.ylabel,
      labels: config.traces.map(({ label }) => label),
      across: config.x ? [config.xlabel] : [],
      columns: whole.columns,
    }))
    download(`${this.config.id}.csv`, curvesText(curves), 'text/csv')
  }

  dispose() {
    this.leaveEditor()
    this.leaveLegend()
    clearTimeout(this.sayTimer)
    this.hands.dispose()
    this.plots.forEach((plot) => plot.dispose())
    this.panel.closeCurves()
    this.simulation.dispose()
    super.dispose()
  }
}
