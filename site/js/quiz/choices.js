/** Questions with options: one right (`mcq`), all that are right (`several`), and predictions. */

import { textWithout } from '../page/select.js'
import { gradeChoice } from './grade.js'
import { copyOf, fill, h, keysIn, shape } from './parts.js'

/** Name an option that is only a formula by its TeX, as not every screen reader takes a name from MathML. */
function nameFormula(input, text) {
  const formulas = [...text.querySelectorAll('math')]
  if (formulas.length === 0 || textWithout(text, 'math') !== '') return
  const texOf = (formula) => formula.querySelector('annotation')?.textContent ?? formula.textContent
  input.setAttribute('aria-label', formulas.map(texOf).join(' '))
}

export class Choices {
  /** @param {import('./question.js').Question} question */
  constructor(question) {
    const { element, words } = question
    this.question = question
    this.words = words
    this.isPrediction = element.dataset.kind === 'predict'
    this.several = element.dataset.kind === 'several' || 'several' in element.dataset
    this.answers = keysIn(element.dataset.answer)
    this.body = element.querySelector(':scope > .options')
    this.options = [...this.body.children].filter((item) => item.dataset.key).map((item) => this.#option(item))
    this.submit = words(this.isPrediction ? 'quiz.live.commit' : 'quiz.live.check')
    this.final = this.isPrediction
  }

  #option(item) {
    const input = h('input', { type: this.several ? 'checkbox' : 'radio', name: 'option', value: item.dataset.key })
    const text = h('span', { class: 'option-text' }, ...item.childNodes)
    const mark = h('span', { class: 'option-mark' })
    nameFormula(input, text)
    item.append(h('label', { class: 'option' }, input, h('span', { class: 'option-body' }, text, ' ', mark)))
    return { key: item.dataset.key, item, input, text, mark }
  }

  entry() {
    const keys = this.options.filter(({ input }) => input.checked).map(({ key }) => key)
    return keys.length > 0 ? keys : null
  }

  /** @returns {boolean} whether there was anything to show */
  show(entry) {
    const keys = Array.isArray(entry) ? entry : []
    for (const { key, input } of this.options) input.checked = keys.includes(key)
    return this.entry() !== null
  }

  focus() {
    this.options[0]?.input.focus()
  }

  grade(entry) {
    const { right, extra, missing } = gradeChoice(entry, this.answers)
    const result = { right, state: right ? 'right' : 'wrong', feedback: entry }
    if (this.isPrediction) return { ...result, finished: true, ...this.#happened(right) }
    if (right || !this.several) return result
    return { ...result, more: fill(this.words('quiz.live.chosen'), { extra, missing }) }
  }

  /** The prediction beside the outcome. */
  #happened(right) {
    const column = (name, keys) => {
      const texts = this.options.filter(({ key }) => keys.includes(key)).map(({ text }) => h('dd', {}, ...copyOf(text)))
      return h('div', {}, h('dt', {}, this.words(name)), ...texts)
    }
    const columns = [column('quiz.live.predicted', this.entry()), column('quiz.live.happens', this.answers)]
    const list = h('dl', { class: 'outcome' }, ...columns)
    return { line: this.words(right ? 'quiz.live.as_predicted' : 'quiz.live.otherwise'), nodes: [list], solution: false }
  }

  /** Mark the options whose verdict may be shown. */
  mark(result) {
    const selected = new Set(result?.feedback ?? [])
    for (const { key, item, input, mark } of this.options) {
      const right = this.answers.includes(key)
      const isDecided = result?.state === 'right' || result?.finished ? right || selected.has(key) : !this.several && selected.has(key)
      const name = !result || !isDecided ? '' : right ? 'right' : 'wrong'
      item.dataset.mark = name
      mark.replaceChildren(...(name ? [shape(name), this.words(`quiz.live.mark_${name}`)] : []))
      input.disabled = this.isPrediction && Boolean(result?.finished)
    }
  }
}
