/**
 * A lab as an instrument: picture, transport, controls, readouts and plots, with its line to the worker.
 *
 *   const instrument = new Instrument(element, config, base, words)
 *
 * `element` is the lab's place in the page, `config` its JSON, `base` the address of that JSON, to which its addresses are relative.
 * docs/labs.md has the messages.
 */

import { connection } from './connection.js'
import { buildControls, buildOverlays, buildReadouts } from './controls.js'
import { download, h } from './dom.js'
import { fillScript } from './export.js'
import { formatReadout, formatTime } from './numbers.js'
import { channels, resolve, watchTheme } from './palette.js'
import { Plot } from './plots.js'
import { Hands } from './pointer.js'
import { writeLink } from './share.js'
import { buildTransport } from './transport.js'
import { prefersStillness } from './support.js'
import { View } from './view.js'

const TEXT_EVERY = 90 // ms: faster than this no eye reads a number
const PLOT_EVERY = 30
const HEIGHT = 300 // CSS pixels

export class Instrument {
  constructor(element, config, base, words) {
    Object.assign(this, { element, config, base, words })
    this.state = 'loading'
    this.values = config.controls.map(({ value }) => value ?? null)
    this.spent = []
    this.latest = null
    this.textAt = this.plotAt = -Infinity
    this.epoch = null
    this.request = 0
    this.tick = (now) => this.refresh(now)
    this.build()
    this.connect()
  }

  // --- the page's side

  build() {
    const { config, words } = this
    const title = config.title || words('lab.untitled')
    this.view = new View({ height: config.height ?? HEIGHT, label: words('lab.live.picture', { title }) })
    this.view.element.setAttribute('aria-label', words('lab.live.view', { title }))
    this.view.colours = () => this.colour()
    this.hands = new Hands(this.view, {
      pull: (request) => this.line.send({ type: 'perturb', ...(request ?? { target: null }) }),
      keys: { ' ': () => this.togglePlay(), '.': () => this.step(), r: () => this.reset() },
    })
    this.transport = buildTransport(words, {
      play: () => this.togglePlay(),
      step: () => this.step(),
      reset: () => this.reset(),
      speed: (factor) => this.line.send({ type: 'speed', factor }),
      full: document.fullscreenEnabled ? () => this.toggleFull() : null,
    })
    this.controls = buildControls(config.controls, {
      set: (index, value) => this.line.send({ type: 'control', index, value }),
      press: (index) => this.line.send({ type: 'press', index }),
    })
    this.overlays = buildOverlays(config, words, (name, on) => this.line.send({ type: 'overlay', name, on }))
    this.readouts = buildReadouts(config.readouts, formatReadout)
    this.plots = config.plots.map((plot) => new Plot(plot, words))
    this.message = h('p', { class: 'lab-message', role: 'alert', hidden: true })
    this.live = h('p', { class: 'lab-announce', role: 'status' })
    const screen = h('div', { class: 'lab-screen' }, this.view.element, this.transport.full)
    this.body = h('div', { class: 'lab-live' }, screen, this.transport.element, this.message, this.controls.element, this.overlays)
    this.body.append(...[this.readouts.element].filter(Boolean), ...this.plots.map((plot) => plot.element), this.foot(), this.live)
    this.controls.show(this.values)
    this.transport.setTime(0)
    this.poster()
    const still = this.element.querySelector('.lab-static')
    if (still !== null) still.before(this.body)
    else this.element.append(this.body)
    this.element.classList.add('lab-on')
    this.unwatch = watchTheme(() => this.colour())
    this.watchSight()
  }

  /** Links and help under the instrument. */
  foot() {
    const { words, config } = this
    const link = h('button', { type: 'button', class: 'lab-text', onclick: () => this.line.send({ type: 'state' }) }, words('lab.live.link'))
    const code = config.exportPython && h('button', { type: 'button', class: 'lab-text', onclick: () => this.export() }, words('lab.live.export'))
    const keys = ['keys_mouse', 'keys_touch', 'keys_camera', 'keys_run'].map((key) => h('li', {}, words(`lab.live.${key}`)))
    const help = h('details', { class: 'lab-help' }, h('summary', {}, words('lab.live.help')), h('ul', {}, ...keys))
    return h('div', { class: 'lab-foot' }, link, code || null, help)
  }

  /** The recorded picture stands in the view until there is a live one. */
  poster() {
    const recorded = this.element.querySelector('.lab-static .lab-picture img, .lab-static img')
    if (recorded === null) return
    const poster = h('img', { class: 'lab-poster', src: recorded.src, alt: '' })
    this.view.element.prepend(poster)
    this.view.onDrawn = () => {
      poster.remove()
      this.view.onDrawn = null
    }
  }

  colour() {
    if (this.view.world?.trail) this.view.world.trail.paint(channels(resolve(this.element, 'var(--trace-2)')))
    this.view.invalidate()
  }

  // A lab out of sight makes no steps.
  watchSight() {
    this.seen = false
    this.sight = new IntersectionObserver(([entry]) => {
      this.seen = entry.isIntersecting
      this.tellSight()
    })
    this.sight.observe(this.body)
    this.onHidden = () => this.tellSight()
    document.addEventListener('visibilitychange', this.onHidden)
  }

  tellSight() {
    this.line?.send({ type: 'visible', on: this.seen && !document.hidden })
    this.view.setMoving(this.state === 'playing' && this.seen)
  }

  // --- the worker's side

  connect() {
    const { config, base } = this
    const address = (path) => new URL(path, base).href
    this.setState('loading')
    this.line = connection(address(config.worker)).open(config.id, (message) => this.receive(message))
    const sent = { ...config, autoplay: Boolean(config.autoplay) && !prefersStillness() }
    this.line.send({
      type: 'load',
      config: sent,
      module: address(config.module),
      mjb: address(config.mjb),
      wasm: address(config.wasm),
    })
    if (this.seen) this.tellSight()
  }

  receive(message) {
    MESSAGES[message.type]?.(this, message)
  }

  opened({ scene, values }) {
    this.setState('paused')
    this.update(values)
    try {
      this.view.open(scene)
    } catch {
      this.view.element.replaceChildren(h('p', { class: 'lab-message' }, this.words('lab.live.no_webgl')))
    }
    if (this.wanted) this.line.send({ type: 'restore', state: this.wanted })
    if (this.pressed) this.line.send({ type: 'play' })
    this.wanted = this.pressed = null
  }

  /** Go to a state of a link, now or when the lab is there. */
  restore(state) {
    if (this.state === 'loading') this.wanted = state
    else this.line.send({ type: 'restore', state })
  }

  took(message) {
    const { buffer, samples } = message
    const spent = this.view.setFrame(new Float32Array(buffer))
    if (spent !== null) this.spent.push(spent.buffer)
    this.collect(samples)
    this.latest = message
    if (this.request === 0) this.request = requestAnimationFrame(this.tick)
  }

  collect({ epoch, times, values }) {
    if (epoch !== this.epoch) {
      this.epoch = epoch
      this.plots.forEach((plot) => plot.clear())
    }
    const width = times.length > 0 ? values.length / times.length : 0
    let offset = 0
    for (const plot of this.plots) {
      plot.push(times, values, width, offset)
      offset += plot.config.traces.length
    }
  }

  /** Once for each picture: buffers go back, and numbers and plots follow, though not as often. */
  refresh(now) {
    this.request = 0
    for (const buffer of this.spent.splice(0)) this.line.send({ type: 'frame', buffer }, [buffer])
    const resting = this.state !== 'playing'
    if (resting || now - this.textAt >= TEXT_EVERY) {
      this.textAt = now
      const { time, readouts, realtime } = this.latest
      if (readouts !== null) this.readouts.show(readouts)
      this.transport.setTime(time)
      this.transport.setRatio(resting ? 1 : realtime)
    }
    if (resting || now - this.plotAt >= PLOT_EVERY) {
      this.plotAt = now
      this.plots.forEach((plot) => plot.draw())
    }
  }

  // --- what a reader does

  togglePlay() {
    if (this.state === 'loading') this.pressed = !this.pressed
    else if (this.state === 'ended') this.again()
    else if (this.state === 'playing') this.line.send({ type: 'pause' })
    else {
      if (this.diverged) this.reset()
      this.line.send({ type: 'play' })
    }
    if (this.state === 'loading') this.transport.setPlaying(this.pressed)
  }

  step() {
    this.line.send({ type: 'step', n: 1 })
  }

  reset() {
    this.line.send({ type: 'reset' })
    this.say('lab.live.said_reset')
  }

  /** After the engine has ended: from the beginning, with a new worker. */
  again() {
    this.line.close()
    this.clear()
    this.pressed = true
    this.connect()
  }

  toggleFull() {
    if (document.fullscreenElement === this.element) document.exitFullscreen()
    else this.element.requestFullscreen().catch(() => {})
  }

  async share(state) {
    const address = new URL(window.location.href)
    address.hash = writeLink(this.config.id, state)
    window.history.replaceState(null, '', address)
    let copied = true
    await navigator.clipboard.writeText(address.href).catch(() => (copied = false))
    this.note(copied ? 'lab.live.link_copied' : 'lab.live.link_shown')
  }

  export() {
    const { name, text } = this.config.exportPython
    download(name, fillScript(text, this.values), 'text/x-python')
  }

  // --- what is shown and said

  setState(state) {
    this.state = state
    this.element.dataset.state = state
    this.transport.setPlaying(state === 'playing')
    this.transport.setEnabled(state !== 'loading' && state !== 'ended')
    this.controls.setEnabled(state !== 'ended')
    this.view.setMoving(state === 'playing' && this.seen)
    if (this.latest !== null && this.request === 0) this.request = requestAnimationFrame(this.tick)
  }

  update(values) {
    this.values = values
    this.controls.show(values)
  }

  /** Tell a screen reader. */
  say(key, values) {
    this.live.textContent = this.words(key, values)
  }

  /** Tell everybody, in the instrument; an error stays until the next reset. */
  tell(text, kind) {
    this.message.textContent = text
    this.message.className = `lab-message lab-is-${kind}`
    this.message.hidden = false
  }

  note(key) {
    this.tell(this.words(key), 'note')
    clearTimeout(this.noteTimer)
    this.noteTimer = setTimeout(() => this.message.classList.contains('lab-is-note') && this.clear(), 4000)
  }

  clear() {
    this.diverged = false
    this.message.hidden = true
    this.message.textContent = ''
  }

  dispose() {
    cancelAnimationFrame(this.request)
    this.sight.disconnect()
    document.removeEventListener('visibilitychange', this.onHidden)
    this.unwatch()
    this.hands.dispose()
    this.plots.forEach((plot) => plot.dispose())
    this.line.close()
    this.view.dispose()
    this.body.remove()
    this.element.classList.remove('lab-on')
    delete this.element.dataset.state
  }
}

/** What each message of the worker does. */
const MESSAGES = {
  ready: (lab, message) => lab.opened(message),
  frame: (lab, message) => lab.took(message),
  playing(lab) {
    if (lab.state === 'playing') return
    lab.clear()
    lab.setState('playing')
    lab.say('lab.live.said_playing')
  },
  paused(lab, { reason }) {
    if (reason === 'offscreen') return // it goes on by itself when it is seen again
    lab.setState('paused')
    if (reason === 'user' || reason === 'code') lab.say('lab.live.said_paused', { t: formatTime(lab.latest?.time ?? 0) })
    if (reason === 'stopAt') lab.say('lab.live.said_stopped', { t: formatTime(lab.config.stopAt ?? 0) })
  },
  controls(lab, { values }) {
    if (lab.diverged) lab.clear()
    lab.update(values)
  },
  diverged(lab, { time, message }) {
    lab.diverged = true
    lab.tell(lab.words('lab.live.diverged', { t: formatTime(time), message }), 'wrong')
  },
  warning: (lab, { time, message }) => lab.tell(lab.words('lab.live.warning', { t: formatTime(time), message }), 'warning'),
  error(lab, { message, entry, kind, fatal }) {
    const where = entry.length > 0 ? placeOf(entry, lab.config) : ''
    lab.tell(where ? lab.words('lab.live.failed_in', { where, message }) : lab.words('lab.live.failed', { message }), 'wrong')
    if (kind === 'load' || fatal) lab.setState('ended')
  },
  state: (lab, { state }) => lab.share(state),
}

/** An entry of the lab's JSON as a reader can find it: the control's label, and the path. */
export function placeOf(entry, config) {
  let value = config
  let label = ''
  for (const key of entry) {
    value = value?.[key]
    if (typeof value?.label === 'string') label = value.label
  }
  const path = entry.map((key) => (typeof key === 'number' ? `[${key + 1}]` : ` ${key}`)).join('').trim()
  return label ? `${path} (${label})` : path
}
