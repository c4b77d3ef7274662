/**
 * A text field with line numbers, an error message that refers to one of its lines, and buttons: one that runs the text, and one that
 * exchanges it for the given one, or back.
 *
 *   const editor = new Editor(text, words, texts, { run, exchange })
 *   editor.fail("Schema violation: unrecognized attribute: 'foo'\nElement 'geom', line 3")
 */

import { freshId, h, onInput, textButton } from './dom.js'
import { LONGEST_MODEL } from './share.js'

const ROWS = 22 // at most; what is longer scrolls

export class Editor {
  /**
   * @param {string} text that is given @param {(key: string, values?: Record<string, any>) => string} words
   * @param {{label: string, run: string, keys: string, back: string, mine: string}} texts of the field, its buttons, and their keys
   * @param {{run: () => void, exchange?: () => void}} on the text is to run; it was exchanged
   */
  constructor(text, words, texts, on) {
    this.words = words
    this.texts = texts
    this.given = this.otherText = text // the other one is the reader's, while the given one is in the field
    const [id, errorId] = [freshId('model'), freshId('wrong')]
    this.error = h('p', { class: 'lab-message lab-is-wrong', id: errorId, role: 'alert', hidden: true })
    this.numbers = h('div', { class: 'lab-numbers', 'aria-hidden': 'true' })
    this.field = h('textarea', {
      id,
      value: text,
      rows: rowsOf(text),
      wrap: 'off',
      maxLength: LONGEST_MODEL,
      spellcheck: false,
      translate: false,
      autocapitalize: 'off',
      autocomplete: 'off',
      dir: 'ltr',
      'aria-describedby': errorId,
      'aria-keyshortcuts': 'Control+Enter Meta+Enter',
    })
    onInput(this.field, () => {
      this.numberLines()
      this.labelBackButton()
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
      h('label', { for: id }, texts.label),
      h('div', { class: 'lab-source', dir: 'ltr' }, this.numbers, this.field),
      this.error,
    )
    this.backButton = textButton('', () => {
      this.exchange()
      on.exchange?.()
    })
    this.runButton = textButton(texts.run, on.run)
    this.element.append(h('div', { class: 'lab-buttons' }, this.runButton, this.backButton, h('span', {}, texts.keys)))
    this.labelBackButton()
    this.numberLines()
  }

  /** Exchange the reader's text for the given one, or back. */
  exchange() {
    const { text, given } = this
    this.text = text === given ? this.otherText : given
    if (text !== given) this.otherText = text
    this.labelBackButton()
  }

  labelBackButton() {
    const { text, given, otherText, texts } = this
    this.backButton.textContent = text !== given || otherText === given ? texts.back : texts.mine
  }

  get text() {
    return this.field.value
  }

  set text(text) {
    this.field.value = text
    this.field.rows = rowsOf(text)
    this.labelBackButton()
    this.clear()
  }

  /** Show an error, and mark the line that it refers to. */
  fail(message) {
    const { line, text } = readError(message)
    const hasLine = line >= 1 && line <= this.lines.length
    this.error.replaceChildren(text)
    this.error.hidden = false
    this.field.setAttribute('aria-invalid', 'true')
    this.numberLines(hasLine ? line : null)
    if (!hasLine) return
    const go = textButton(this.words('lab.live.line', { line }), () => this.goTo(line), 'lab-text')
    this.error.prepend(go, ' ')
    this.reveal(line)
  }

  clear() {
    this.error.hidden = true
    this.error.replaceChildren()
    this.field.removeAttribute('aria-invalid')
    this.numberLines()
  }

  get lines() {
    return this.text.split('\n')
  }

  /** Draw the line numbers, with a mark at the line of the error, if any. */
  numberLines(errorLine = this.error.hidden ? null : this.errorLine) {
    this.errorLine = errorLine
    const count = this.lines.length
    const parts = errorLine === null ? [range(1, count)] : [range(1, errorLine - 1), h('mark', {}, String(errorLine)), range(errorLine + 1, count)]
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

const rowsOf = (text) => Math.min(ROWS, text.split('\n').length)

/** The text of MuJoCo's error about a model, and the line that it names, or 0. */
export function readError(message) {
  const lineMatch = /, line (\d+)\s*$|Line number=(\d+)/.exec(message)
  const text = message
    .trim()
    .replace(/^(?:(?:XML )?Error: )+/, '')
    .replace(/^XML parse error \d+:\s*Error=(?:XML_)?(?:ERROR_)?(\w+) .*?(?:XMLElement name=(\S+))?$/s, (_, code, name) => {
      const words = code.replaceAll('_', ' ').toLowerCase()
      return `XML: ${words}${name ? `\nElement '${name}'` : ''}`
    })
  return { line: lineMatch ? Number(lineMatch[1] ?? lineMatch[2]) : 0, text }
}
