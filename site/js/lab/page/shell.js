/** What every instrument of a lab has: its body in place of the static form, a goal, texts, buttons, full screen, and an end. */

import { h, textButton } from './dom.js'
import { GoalView } from './goal.js'
import { Notices } from './notices.js'
import { formatTime } from './numbers.js'
import { copyLink, writeLink } from './share.js'
import { watchSight } from './support.js'

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
    const say = (text) => this.notices.say(text)
    return goal ? new GoalView(goal, this.config.goal, this.words, { progress: this.progress, say, ...options }) : null
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
    this.unwatch = watchSight(body, see)
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

  /** Put a link to a state into the address bar and the clipboard, and say what it holds. */
  async share(state) {
    const { words, notices, config } = this
    const { link, only } = await writeLink(config.id, state)
    const key = await copyLink(link)
    if (only === null) notices.show(words(key), 'note')
    else notices.show(`${words(key)} ${words(`lab.live.link_${only}`)}`, 'warning')
  }

  dispose() {
    this.unwatch()
    this.goal?.dispose()
    this.body.remove()
    this.element.classList.remove('lab-on')
    delete this.element.dataset.state
  }
}
