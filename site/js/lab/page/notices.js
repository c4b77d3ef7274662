/** A lab's notices: a visible line, and one for screen readers only. */

import { h } from './dom.js'

const SHORT = 4000 // ms

export class Notices {
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
