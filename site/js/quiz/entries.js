/** Questions that are answered in a field: a number, a line that a script prints, or words. */

import { formatLabel } from '../lab/page/numbers.js'
import { gradeNumber } from './grade.js'
import { compareBy, gradeOutput } from './output.js'
import { copyOf, fill, h } from './parts.js'

const MARKS = ['right', 'partly', 'wrong']

/** A field with its label and help. */
class Entry {
  keepsVerdict = true // the verdict stays while a wrong answer is being corrected

  constructor(question, label, { help = '', unit = null, code = false } = {}) {
    this.question = question
    this.words = question.words
    this.submit = this.words('quiz.live.check')
    const ids = { input: question.id('entry'), help: question.id('help'), unit: question.id('unit') }
    const describedBy = [unit && ids.unit, help && ids.help].filter(Boolean).join(' ')
    this.input = h('input', {
      id: ids.input,
      type: 'text',
      dir: 'ltr',
      class: code ? 'quiz-entry-field quiz-entry-code' : 'quiz-entry-field',
      autocomplete: 'off',
      autocapitalize: 'off',
      spellcheck: false,
      maxLength: 1000,
      'aria-describedby': describedBy || null,
    })
    this.body = h(
      'div',
      { class: 'quiz-entry' },
      h('label', { class: 'quiz-entry-label', for: ids.input }, label),
      h('span', { class: 'quiz-entry-row' }, this.input, unit && h('span', { class: 'quiz-entry-unit', id: ids.unit }, ...copyOf(unit))),
      help && h('p', { class: 'quiz-entry-help', id: ids.help }, help),
    )
  }

  entry() {
    return this.input.value.trim() === '' ? null : this.input.value
  }

  show(entry) {
    this.input.value = typeof entry === 'string' ? entry : ''
    return this.entry() !== null
  }

  focus() {
    this.input.focus()
  }

  mark(result) {
    if (result?.state === 'unread' || result?.state === 'wrong') this.input.setAttribute('aria-invalid', 'true')
    else this.input.removeAttribute('aria-invalid')
  }
}

export class Numeric extends Entry {
  constructor(question) {
    const { element, words } = question
    const unit = element.querySelector(':scope > .question-how .unit')
    const help = unit ? `${words('quiz.live.number_help')} ${words('quiz.live.unit_help')}` : words('quiz.live.number_help')
    super(question, words('quiz.live.number'), { help, unit })
    this.unit = unit
    this.expected = {
      answer: Number(element.dataset.answer),
      tolerance: Number(element.dataset.tolerance),
      unit: element.dataset.unit ?? '',
    }
  }

  grade(entry) {
    const result = gradeNumber(entry, this.expected)
    if (result.state === 'unread') {
      const [first = '', second = ''] = result.readings
      const text = fill(this.words(`quiz.live.unread.${result.problem}`), { detail: result.detail, first, second })
      return { state: 'unread', right: null, line: this.words('quiz.live.unread.line'), more: text }
    }
    const right = result.state === 'right'
    // A point may have been meant to separate thousands: show how it was read.
    const unsure = !right && /(?:^|\D)[1-9]\d{0,2}\.\d{3}(?!\d)/.test(entry)
    const nodes = result.converted || (unsure && result.slip !== 'unit') ? [this.#interpretation(result.value)] : []
    const more = result.slip ? this.words(`quiz.live.near.${result.slip}`) : ''
    return { state: result.state, right, more, nodes, solution: right }
  }

  /** The number as it was understood. */
  #interpretation(value) {
    const unit = this.unit ? [' ', ...copyOf(this.unit)] : []
    return h('p', { class: 'quiz-entry-read' }, `${this.words('quiz.live.read_as')} `, h('bdi', { dir: 'ltr' }, formatLabel(value), ...unit))
  }
}

export class Output extends Entry {
  constructor(question) {
    const { element, words } = question
    super(question, words('quiz.live.line'), { code: true })
    this.expectedLine = element.dataset.answer
    this.isEqual = compareBy(element.dataset.compare ?? 'digits')
  }

  grade(entry) {
    const { right, slip } = gradeOutput(entry, this.expectedLine, this.isEqual)
    return { state: right ? 'right' : 'wrong', right, more: slip ? this.words(`quiz.live.printed.${slip}`) : '', solution: right }
  }
}

/** Questions that are answered in words: the learner writes, compares with the reference, and says how well the two agree. */
export class Open {
  keepsReference = true // the reference stays in sight while the answer is edited

  constructor(question) {
    this.question = question
    this.words = question.words
    this.submit = this.words('quiz.live.compare')
    const id = question.id('entry')
    const onChange = () => this.question.result?.finished && this.#gradeMark()
    this.input = h('textarea', { id, class: 'quiz-entry-field', dir: 'auto', rows: 4, maxLength: 20_000, onchange: onChange })
    const label = h('label', { class: 'quiz-entry-label', for: id }, this.words('quiz.live.words'))
    this.body = h('div', { class: 'quiz-entry' }, label, this.input)
    this.radios = MARKS.map((value) => h('input', { type: 'radio', name: 'mark', value, onchange: () => this.#gradeMark() }))
    const name = (mark) => h('span', {}, this.words(`quiz.live.self.${mark}`))
    const labels = this.radios.map((radio) => h('label', { class: 'option' }, radio, name(radio.value)))
    this.footer = h('fieldset', { class: 'self-mark', hidden: true }, h('legend', {}, this.words('quiz.live.self.how')), ...labels)
  }

  entry() {
    if (this.input.value.trim() === '') return null
    return { text: this.input.value, mark: this.radios.find(({ checked }) => checked)?.value ?? '' }
  }

  show(entry) {
    this.input.value = typeof entry?.text === 'string' ? entry.text : ''
    for (const radio of this.radios) radio.checked = radio.value === entry?.mark
    return this.entry() !== null
  }

  focus() {
    this.input.focus()
  }

  grade({ mark }) {
    const state = MARKS.includes(mark) ? mark : 'done'
    // A partly right answer comes back in the review like a wrong one.
    const right = state === 'done' ? null : state === 'right'
    const line = this.words(state === 'done' ? 'quiz.live.self.compare' : `quiz.live.self.said_${state}`)
    return { state, right, line, solution: true, finished: true }
  }

  mark(result) {
    this.footer.hidden = !result || result.state === 'unread'
  }

  #gradeMark() {
    this.question.note(this.grade(this.entry() ?? { mark: '' }))
  }
}
