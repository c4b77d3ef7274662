/** Questions that are answered in words: the learner writes, compares with the reference, and says how well the two agree. */

import { h } from './parts.js'

const MARKS = ['right', 'partly', 'wrong']

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

  clear() {
    this.input.value = ''
    for (const radio of this.radios) radio.checked = false
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
