/** A lab's goal in the page: its text, for how long it has held, and whether this reader has reached it. */

import { sign } from '../../progress/signs.js'
import { h, textButton } from './dom.js'
import { formatTime } from './numbers.js'

export class GoalView {
  /**
   * @param {HTMLElement} still the goal in the lab's static form
   * @param {{hold: number}} goal of the lab's JSON
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {{progress: Record<string, any> | null, say: (text: string) => void, show: () => void, unit?: string, format?: (time: number) => string}}
   *   services `progress`: see progress/store.js; `unit` and `format` of times
   */
  constructor(still, { hold }, words, { progress, say, show, unit = ' s', format = formatTime }) {
    this.unit = unit
    this.textOf = (time) => `${format(time)}${unit}`
    this.hold = hold
    this.words = words
    this.progress = progress
    this.say = say
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
    return this.progress?.get(this.key, this.key)?.right === true
  }

  /** @param {{held: number, reached: number | null, counts: boolean}} status of a frame */
  show(status) {
    const previous = this.status
    this.status = status
    if (status.reached !== previous.reached && status.reached !== null && status.counts) this.note(status.reached)
    this.draw()
  }

  note(time) {
    this.say(this.words('lab.live.goal_reached', { t: this.textOf(time) }))
    if (this.isStored) return
    const lesson = document.querySelector('main')?.dataset.lesson ?? ''
    this.progress?.put(this.key, this.key, { kind: 'goal', given: time, right: true, tries: 1, hints: 0, number: 1, lesson })
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
