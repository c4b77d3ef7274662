/** What a lab tells: a line that everybody sees, and one that only screen readers do. */

import { h } from './dom.js'

const SHORT = 4000 // ms

export class Notices {
  /** @param {(key: string, values?: object) => string} words */
  constructor(words) {
    this.words = words
    this.shown = h('p', { class: 'lab-message', role: 'alert', hidden: true })
    this.spoken = h('p', { class: 'lab-announce unseen', role: 'status' })
    this.timer = 0
  }

  /** Tell a screen reader. */
  say(text) {
    this.spoken.textContent = text
  }

  /** @param {'wrong' | 'warning' | 'note'} kind a note goes away by itself */
  show(text, kind) {
    clearTimeout(this.timer)
    this.shown.textContent = text
    this.shown.className = `lab-message lab-is-${kind}`
    this.shown.hidden = false
    if (kind === 'note') this.timer = setTimeout(() => this.clear(), SHORT)
  }

  clear() {
    clearTimeout(this.timer)
    this.shown.hidden = true
    this.shown.textContent = ''
  }

  /** An error of the worker, with the place in the lab's JSON. */
  failure({ message, entry }, config) {
    const { words } = this
    const where = entry.length > 0 ? placeOf(entry, config) : ''
    this.show(where ? words('lab.live.failed_in', { where, message }) : words('lab.live.failed', { message }), 'wrong')
  }
}

/** An entry of the lab's JSON as its author finds it, with its label: `controls[2].run ("push")`. */
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
