/**
 * One simulation of the worker, as seen by the page: its line, its picture, and its state.
 *
 *   const simulation = new Simulation({ config, base, view, on })
 *   simulation.play(); simulation.set(0, 3); simulation.dispose()
 *
 * `on` holds listeners, all optional:
 *
 *   state(state, reason)   'asleep' (nothing is loaded before something is asked of it), 'loading', 'paused', 'playing', 'ended' (it will not run again)
 *   ready({scene, values, time, version})
 *   samples({epoch, from, times, values}, fresh)   `fresh`: a new run began, earlier samples belong to another
 *   refresh(frame, now)    once for each picture at most: {time, readouts, realtime, goal, panel, tape}
 *   model(model)           what the model offers (core/panel.js), after `inspect(true)`
 *   controls(values)       lab code may have changed them
 *   diverged({time, kind, message}), warning({time, kind, message}), error({message, entry, kind, fatal}), saved(state)
 *   noPicture()            the browser has no WebGL
 *
 * Every frame is answered at the next refresh of the screen, so that the worker sends one for each. The answer is the buffer of
 * the previous frame: the newest stays here, to be drawn again when the camera moves.
 */

import { connection, startConfined } from './connection.js'
import { prefersStillness } from './dom.js'

export class Simulation {
  /**
   * @param {object} options
   * @param {Record<string, any>} options.config the lab's JSON; `worker`, `wasm`, `module` and `mjb` are addresses
   * @param {string} options.base to which these are relative
   * @param {import('./view.js').View | null} [options.view] shows it
   * @param {Record<string, any>} [options.on] listeners
   */
  constructor({ config, base, view = null, on = {} }) {
    /** @type {Record<string, any>} */
    this.config = { ...config, autoplay: Boolean(config.autoplay) && !prefersStillness() }
    this.view = view
    this.on = on
    /** @type {HTMLElement | null} of a custom lab: see custom.js */
    this.element = null
    this.base = base
    this.visible = false
    this.own = null
    this.settings = new Map() // messages to repeat after a restart: speed, overlays, inspection
    this.tick = (now) => this.refresh(now)
    this.request = 0
    this.line = null
    this.pointed = null
    this.latest = null
    if (this.config.autoplay) this.connect()
    else this.setState('asleep')
  }

  /** Load the engine and the model; what is asked of them meanwhile is done then. */
  connect() {
    const { config } = this
    const { worker, ...addresses } = this.addresses
    this.spentBuffers = [] // one for each frame not yet answered; null: the worker has to make a new one
    this.latest = null
    this.epoch = null
    this.diverged = false
    this.setState('loading')
    const start = config.exercise ? startConfined : undefined
    this.line = connection(worker, start).open(config.id, (message) => MESSAGES[message.type]?.(this, message))
    this.send({ type: 'load', config, own: this.own, ...addresses })
    this.send({ type: 'visible', on: this.visible })
  }

  /** Where its worker, and what that loads, are; absolute. */
  get addresses() {
    const entries = ['worker', 'module', 'mjb', 'wasm'].map((name) => [name, this.config[name]])
    return Object.fromEntries(entries.map(([name, path]) => [name, path ? new URL(path, this.base).href : '']))
  }

  send(message, transfer) {
    if (this.line === null) {
      if (message.type === 'visible') return
      this.connect()
    }
    this.line.send(message, transfer)
  }

  /** Begin to load, if nothing was asked of it before. */
  wake() {
    if (this.line === null) this.connect()
  }

  setState(state, reason = null) {
    this.state = state
    this.view?.setMoving(state === 'playing' && this.visible)
    this.on.state?.(state, reason)
    this.schedule()
  }

  // --- actions

  play() {
    if (this.state === 'ended') this.restart()
    else if (this.diverged) this.reset()
    this.send({ type: 'play' })
  }

  pause() {
    this.send({ type: 'pause' })
  }

  step(n = 1) {
    this.send({ type: 'step', n })
  }

  /** Go to another time (s) of the run. */
  seek(time) {
    this.send({ type: 'seek', time })
  }

  reset() {
    this.send({ type: 'reset' })
  }

  /** Simulated seconds for each real one. */
  speed(factor) {
    this.choose('speed', { type: 'speed', factor })
  }

  choose(key, message) {
    this.settings.set(key, message)
    this.send(message)
  }

  /** Set a control to a value; `play`: and run. */
  set(index, value, play = false) {
    this.send({ type: 'control', index, value, play })
  }

  /** Press a button; `play`: and run, unless its code pauses. */
  press(index, play = false) {
    this.send({ type: 'press', index, play })
  }

  overlay(name, on) {
    this.choose(name, { type: 'overlay', name, on })
  }

  /** Draw an overlay while the reader points at it, if the lab is loaded or `isAsked` to. @param {string | null} name `null`: none */
  point(name, isAsked = false) {
    if (name === this.pointed || (this.line === null && !isAsked)) return
    this.pointed = name
    this.send({ type: 'point', name })
  }

  /** Begin or stop to receive what the model offers, and with each frame its values. */
  inspect(on) {
    this.choose('inspect', { type: 'inspect', on })
  }

  /** Receive the numbers of a part of an inspected model with each frame, or of none. @param {{kind: string, index: number} | null} part */
  examine(part) {
    this.send({ type: 'examine', part })
  }

  /** Set the control signal of an actuator of the model; `play`: and run. */
  actuate(index, value, play = false) {
    this.send({ type: 'actuate', index, value, play })
  }

  /** Begin again at a keyframe of the model. */
  startAt(index) {
    this.send({ type: 'keyframe', index })
  }

  /** Pull a body: `{body, point, target}`, then `{body, target}`; null lets go. */
  pull(request) {
    this.send({ type: 'perturb', ...(request ?? { target: null }) })
  }

  /** Ask for the state, which comes to `on.saved`. */
  save() {
    this.send({ type: 'state' })
  }

  restore(state) {
    this.send({ type: 'restore', state })
  }

  /** Replay a log from its reset. */
  replay(log) {
    this.send({ type: 'replay', log })
  }

  /** Set whether the lab is in sight; out of sight it makes no steps. */
  setVisible(on) {
    if (on === this.visible) return
    this.visible = on
    this.send({ type: 'visible', on })
    this.view?.setMoving(this.state === 'playing' && on)
  }

  /**
   * Start again with another model, MJCF, and the files that it may name (page/files.js).
   *
   * @param {string} xml @param {any} own @param {boolean} isOther whether it is no edition of the lab's model, whose camera then stays
   */
  load(xml, own, isOther) {
    this.config = { ...this.config, xml, isOther }
    this.own = own
    this.restart()
  }

  /** Start again, with a new engine if the worker is dedicated or has ended. */
  restart() {
    this.line?.close()
    cancelAnimationFrame(this.request)
    this.request = 0
    this.connect()
    for (const message of this.settings.values()) this.send(message)
  }

  dispose() {
    cancelAnimationFrame(this.request)
    this.request = -1
    this.line?.close()
    this.view?.dispose()
  }

  // --- messages of the worker

  onReady(message) {
    try {
      this.view?.open(message.scene)
    } catch {
      this.view.dispose()
      this.view = null
      this.on.noPicture?.()
    }
    this.on.ready?.(message)
    if (this.state === 'loading') this.setState('paused')
  }

  onFrame(frame) {
    const { buffer, samples } = frame
    const previous = this.view === null ? { buffer } : this.view.setFrame(new Float32Array(buffer))
    this.spentBuffers.push(previous?.buffer ?? null)
    this.latest = frame
    const fresh = samples.epoch !== this.epoch
    this.epoch = samples.epoch
    this.on.samples?.(samples, fresh)
    this.schedule()
  }

  schedule() {
    if (this.request === 0 && this.latest !== null) this.request = requestAnimationFrame(this.tick)
  }

  refresh(now) {
    this.request = 0
    for (const buffer of this.spentBuffers.splice(0)) this.send({ type: 'frame', buffer }, buffer === null ? [] : [buffer])
    this.on.refresh?.(this.latest, now)
  }
}

/** The handlers of the worker's messages. */
const MESSAGES = {
  ready: (simulation, message) => simulation.onReady(message),
  frame: (simulation, message) => simulation.onFrame(message),
  playing: (simulation) => simulation.state === 'playing' || simulation.setState('playing'),
  // Out of sight it only waits, which is no pause.
  paused: (simulation, { reason }) => reason === 'offscreen' || simulation.setState('paused', reason),
  model: (simulation, { model }) => simulation.on.model?.(model),
  controls(simulation, { values }) {
    simulation.diverged = false
    simulation.on.controls?.(values)
  },
  diverged(simulation, message) {
    simulation.diverged = true
    simulation.on.diverged?.(message)
  },
  warning: (simulation, message) => simulation.on.warning?.(message),
  error(simulation, message) {
    simulation.on.error?.(message)
    if (message.kind === 'load' || message.fatal) simulation.setState('ended')
  },
  state: (simulation, { state }) => simulation.on.saved?.(state),
}
