/**
 * A text that the reader edits, with numbers of its lines and what is wrong in one of them.
 *
 *   const editor = new Editor(text, words, { run, input })
 *   editor.fail("Schema violation: unrecognized attribute: 'foo'\nElement 'geom', line 3")
 */

import { freshId, h } from './dom.js'
import { LONGEST_MODEL } from './share.js'

const ROWS = 22 // at most; what is longer scrolls

export class Editor {
  /** @param {{run: () => void, input: () => void}} on Ctrl or Cmd with Enter, and every change of the text */
  constructor(text, words, on) {
    this.words = words
    const [id, wrong] = [freshId('model'), freshId('wrong')]
    this.error = h('p', { class: 'lab-message lab-is-wrong', id: wrong, role: 'alert', hidden: true })
    this.numbers = h('div', { class: 'lab-numbers', 'aria-hidden': 'true' })
    this.field = h('textarea', {
      id,
      value: text,
      rows: Math.min(ROWS, text.split('\n').length),
      wrap: 'off',
      maxLength: LONGEST_MODEL,
      spellcheck: false,
      translate: false,
      autocapitalize: 'off',
      autocomplete: 'off',
      dir: 'ltr',
      'aria-describedby': wrong,
      'aria-keyshortcuts': 'Control+Enter Meta+Enter',
    })
    let request = 0 // a text of many lines may come as an event for each
    this.field.addEventListener('input', () => {
      cancelAnimationFrame(request)
      request = requestAnimationFrame(() => {
        this.number()
        on.input()
      })
    })
    this.field.addEventListener('scroll', () => (this.numbers.scrollTop = this.field.scrollTop))
    this.field.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' || !(event.ctrlKey || event.metaKey)) return
      event.preventDefault()
      on.run()
    })
    this.element = h(
      'div',
      { class: 'lab-editor' },
      h('label', { for: id }, words('lab.live.model')),
      h('div', { class: 'lab-source', dir: 'ltr' }, this.numbers, this.field),
      this.error,
    )
    this.number()
  }

  get text() {
    return this.field.value
  }

  set text(text) {
    this.field.value = text
    this.clear()
  }

  /** Tell what is wrong, and mark the line that it is about. */
  fail(message) {
    const { line, text } = readError(message)
    const known = line >= 1 && line <= this.lines.length
    this.error.replaceChildren(text)
    this.error.hidden = false
    this.field.setAttribute('aria-invalid', 'true')
    this.number(known ? line : null)
    if (!known) return
    const go = h('button', { type: 'button', class: 'lab-text', onclick: () => this.goTo(line) })
    go.textContent = this.words('lab.live.line', { line })
    this.error.prepend(go, ' ')
    this.reveal(line)
  }

  clear() {
    this.error.hidden = true
    this.error.replaceChildren()
    this.field.removeAttribute('aria-invalid')
    this.number()
  }

  get lines() {
    return this.text.split('\n')
  }

  /** Number the lines; one of them may be wrong, until that is cleared. */
  number(wrong = this.error.hidden ? null : this.wrong) {
    this.wrong = wrong
    const count = this.lines.length
    const parts = wrong === null ? [range(1, count)] : [range(1, wrong - 1), h('mark', {}, String(wrong)), range(wrong + 1, count)]
    this.numbers.replaceChildren(...parts)
    this.numbers.scrollTop = this.field.scrollTop
  }

  reveal(line) {
    const { field } = this
    field.scrollTop = (line - 0.5) * Number.parseFloat(getComputedStyle(field).lineHeight) - field.clientHeight / 2
  }

  goTo(line) {
    const start = this.lines.slice(0, line - 1).reduce((sum, { length }) => sum + length + 1, 0)
    this.field.focus()
    this.field.setSelectionRange(start, start + this.lines[line - 1].length)
    this.reveal(line)
  }
}

function range(first, last) {
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => first + i).join('\n')
}

/** What MuJoCo says of a model, and the line that it says it of: 0 where it names none. */
export function readError(message) {
  const found = /, line (\d+)\s*$|Line number=(\d+)/.exec(message)
  const text = message
    .trim()
    .replace(/^(?:(?:XML )?Error: )+/, '')
    .replace(/^XML parse error \d+:\s*Error=(?:XML_)?(?:ERROR_)?(\w+) .*?(?:XMLElement name=(\S+))?$/s, (_, what, name) => {
      const words = what.replaceAll('_', ' ').toLowerCase()
      return `XML: ${words}${name ? `\nElement '${name}'` : ''}`
    })
  return { line: found ? Number(found[1] ?? found[2]) : 0, text }
}
