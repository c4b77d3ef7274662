/** What every instrument of a lab has: its body in place of the static form, a goal, texts, buttons, full screen, and an end. */

import { sign } from '../../progress/signs.js'
import { h, textButton } from './dom.js'
import { formatTime } from './numbers.js'
import { copyLink, writeLink } from './share.js'

const SHORT = 4000 // ms, of a note

export class Shell {
  /**
   * @param {HTMLElement} element the lab's place in the page @param {any} config its JSON
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {Record<string, any> | null} progress stores a reached goal (progress/store.js)
   */
  constructor(element, config, words, progress) {
    this.element = element
    this.config = config
    this.words = words
    this.progress = progress
    this.notices = new Notices(words)
    /** @type {GoalView | null} */
    this.goal = null
  }

  /** The view of the lab's goal, if it has one. @param {{show: () => void, unit?: string, format?: (time: number) => string}} options of GoalView */
  makeGoal(options) {
    const goal = this.config.goal && this.element.querySelector('.lab-goal')
    return goal ? new GoalView(goal, this, options) : null
  }

  /** Whether this reader has reached a goal, or solved an exercise, before. */
  hasDone(key) {
    return this.progress?.get(key, key)?.right === true
  }

  /** Store that this is done; returns what is stored. */
  storeDone(key, kind, given, tries = 1) {
    const lesson = document.querySelector('main')?.dataset.lesson ?? ''
    const answer = { kind, given, right: true, tries, hints: 0, number: 1, lesson }
    this.progress?.put(key, key, answer)
    return answer
  }

  /** A button that looks like text, by the key of what it says. */
  makeButton(key, run) {
    return textButton(this.words(`lab.live.${key}`), run, 'lab-text')
  }

  /** What is said of keys and hands, folded. */
  makeHelp(keys) {
    const { words } = this
    const list = h('ul', {}, ...keys.map((key) => h('li', {}, words(`lab.live.${key}`))))
    return h('details', { class: 'lab-help' }, h('summary', {}, words('lab.live.help')), list)
  }

  /**
   * Make the body and show it.
   *
   * @param {string} kind its class, beside that of all labs @param {(Node | null)[]} stage @param {(Node | null)[]} side
   * @param {Node} foot below both
   * @param {(isVisible: boolean) => void} see the lab comes into sight or leaves it
   */
  show(kind, stage, side, foot, see) {
    const parts = [h('div', { class: 'lab-stage' }, ...stage), h('div', { class: 'lab-side' }, ...side), foot, this.notices.announcement]
    this.put(h('div', { class: kind }, ...parts), see)
    this.element.classList.add('lab-on')
  }

  /** Put a body before the static form, which is hidden as soon as the lab is on. */
  put(body, see) {
    const still = this.element.querySelector('.lab-static')
    this.body = body
    this.element.querySelector('.lab-room')?.remove()
    if (still !== null) still.before(body)
    else this.element.append(body)
    this.unwatch = watchSight(this.element, see) // style sheets may leave the body no box of its own
  }

  /** Listeners of a simulation that say what goes wrong in it. @param {any} config its lab's JSON @param {import('./view.js').View | null} view */
  faults(config, view) {
    const { words, notices } = this
    return {
      diverged: ({ time, message }) => notices.show(words('lab.live.diverged', { t: formatTime(time), message }), 'wrong'),
      error: (error) => notices.failure(error, config),
      noPicture: () => view.element.replaceChildren(h('p', { class: 'lab-message lab-is-wrong' }, words('lab.live.no_webgl'))),
    }
  }

  /** Switches full screen on or off; null if the browser has none. */
  get full() {
    if (!document.fullscreenEnabled) return null
    return () => {
      if (document.fullscreenElement === this.element) document.exitFullscreen()
      else this.element.requestFullscreen().catch(() => {})
    }
  }

  /**
   * Put a link to a state into the address bar and the clipboard, and say what it holds.
   *
   * @param {Parameters<typeof writeLink>[1]} state @param {string} [lack] the key of what it never holds
   */
  async share(state, lack = '') {
    const { words, notices, config } = this
    const { link, only } = await writeLink(config.id, state)
    if (only !== null && state.text !== undefined) return notices.show(words('lab.live.link_long'), 'warning')
    const lacking = only ?? lack
    const said = [await copyLink(link), lacking && `lab.live.link_${lacking}`].filter(Boolean)
    notices.show(said.map((key) => words(key)).join(' '), lacking ? 'warning' : 'note')
  }

  dispose() {
    this.unwatch()
    this.goal?.dispose()
    this.body.remove()
    this.element.classList.remove('lab-on')
    delete this.element.dataset.state
  }
}

/** What is said of a lab: in a visible line, and in one for screen readers only. */
class Notices {
  /** @param {(key: string, values?: Record<string, any>) => string} words */
  constructor(words) {
    this.words = words
    this.message = h('p', { class: 'lab-message', role: 'alert', hidden: true })
    this.announcement = h('p', { class: 'lab-announce unseen', role: 'status' })
    this.timer = 0
  }

  /** Announce a text to screen readers. */
  say(text) {
    this.announcement.textContent = text
  }

  /** @param {'wrong' | 'warning' | 'note'} kind a note goes away by itself */
  show(text, kind) {
    clearTimeout(this.timer)
    this.message.textContent = text
    this.message.className = `lab-message lab-is-${kind}`
    this.message.hidden = false
    if (kind === 'note') this.timer = setTimeout(() => this.clear(), SHORT)
  }

  clear() {
    clearTimeout(this.timer)
    this.message.hidden = true
    this.message.textContent = ''
  }

  /** An error of the worker, with the place in the lab's JSON. */
  failure({ message, entry }, config) {
    const { words } = this
    const place = entry.length > 0 ? placeOf(entry, config) : ''
    this.show(place ? words('lab.live.failed_in', { where: place, message }) : words('lab.live.failed', { message }), 'wrong')
  }
}

/** An entry of the lab's JSON as its author writes it, with its label: `controls[2].run ("push")`. */
export function placeOf(entry, config) {
  let value = config
  let label = ''
  for (const key of entry) {
    value = value?.[key]
    if (typeof value?.label === 'string') label = value.label
  }
  const path = entry.reduce((text, key) => text + (typeof key === 'number' ? `[${key}]` : text === '' ? key : `.${key}`), '')
  return label ? `${path} (“${label}”)` : path
}

/** A goal in the page: its text, for how long it has held, and whether this reader has reached it. */
class GoalView {
  /**
   * @param {HTMLElement} still the goal in the lab's static form
   * @param {Shell} shell of the lab
   * @param {{show: () => void, unit?: string, format?: (time: number) => string}} options `unit` and `format` of times
   */
  constructor(still, shell, { show, unit = ' s', format = formatTime }) {
    const { words, progress, config } = shell
    const { hold } = config.goal
    this.shell = shell
    this.unit = unit
    this.textOf = (time) => `${format(time)}${unit}`
    this.hold = hold
    this.words = words
    this.key = still.dataset.goal
    this.status = { held: 0, reached: null, counts: true }
    this.bar = h('progress', { max: hold, value: 0, 'aria-hidden': 'true', hidden: hold === 0 })
    this.text = h('span', {})
    const button = textButton(words('lab.live.goal_show'), show, 'lab-text')
    const state = h('p', { class: 'lab-goal-state' }, this.bar, this.text, button)
    this.element = h('div', { class: 'lab-goal' }, ...still.cloneNode(true).childNodes, state)
    this.leave = progress?.onChange(() => this.draw())
    this.draw()
  }

  get isStored() {
    return this.shell.hasDone(this.key)
  }

  /** @param {{held: number, reached: number | null, counts: boolean}} status of a frame */
  show(status) {
    const previous = this.status
    this.status = status
    if (status.reached !== previous.reached && status.reached !== null && status.counts) this.note(status.reached)
    this.draw()
  }

  note(time) {
    this.shell.notices.say(this.words('lab.live.goal_reached', { t: this.textOf(time) }))
    if (!this.isStored) this.shell.storeDone(this.key, 'goal', time)
  }

  draw() {
    const { words, hold, status } = this
    const { held, reached, counts } = status
    let text = hold > 0 ? words('lab.live.goal_held', { t: this.textOf(held), hold: `${hold}${this.unit}` }) : ''
    if (reached !== null) text = words('lab.live.goal_reached', { t: this.textOf(reached) })
    else if (this.isStored) text = `${words('lab.live.goal_kept')} ${text}`
    if (!counts && !this.isStored) text += ` ${words('lab.live.goal_other')}`
    this.bar.value = reached === null ? held : hold
    if (text === this.shownText) return
    this.shownText = text
    this.text.replaceChildren(...(this.isStored ? [sign('read')] : []), text)
  }

  dispose() {
    this.leave?.()
  }
}

/**
 * Call `callback(isVisible)` when that changes, and once at first: whether an element is in the window, and its tab in front.
 *
 * @returns {() => void} stops it
 */
function watchSight(element, callback) {
  let isIntersecting = false
  const tell = () => callback(isIntersecting && !document.hidden)
  const observer = new IntersectionObserver((entries) => {
    isIntersecting = entries[entries.length - 1].isIntersecting
    tell()
  })
  observer.observe(element)
  document.addEventListener('visibilitychange', tell)
  return () => {
    observer.disconnect()
    document.removeEventListener('visibilitychange', tell)
  }
}
