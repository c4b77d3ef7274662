/** Questions with options: one right (`mcq`), all that are right (`several`), and predictions. */

import { gradeChoice } from './grade.js'
import { copyOf, fill, h, keysIn, shape } from './parts.js'

/** Names are made of text, and a formula alone has none that every reader of screens takes: it is called as it is written in TeX. */
function nameFormula(input, text) {
  const formulas = [...text.querySelectorAll('math')]
  const words = [text.textContent, ...formulas.map((formula) => formula.textContent)].reduce((rest, part) => rest.replace(part, ''))
  if (formulas.length === 0 || words.trim()) return
  const written = (formula) => formula.querySelector('annotation')?.textContent ?? formula.textContent
  input.setAttribute('aria-label', formulas.map(written).join(' '))
}

export class Choices {
  /** @param {import('./question.js').Question} question */
  constructor(question) {
    const { element, words } = question
    this.question = question
    this.words = words
    this.predict = element.dataset.kind === 'predict'
    this.several = element.dataset.kind === 'several' || 'several' in element.dataset
    this.answers = keysIn(element.dataset.answer)
    this.body = element.querySelector(':scope > .options')
    this.options = [...this.body.children].filter((item) => item.dataset.key).map((item) => this.#option(item))
    this.submit = words(this.predict ? 'quiz.live.commit' : 'quiz.live.check')
    this.final = this.predict
  }

  #option(item) {
    const input = h('input', { type: this.several ? 'checkbox' : 'radio', name: 'option', value: item.dataset.key })
    const text = h('span', { class: 'option-text' }, ...item.childNodes)
    const mark = h('span', { class: 'option-mark' })
    nameFormula(input, text)
    item.append(h('label', { class: 'option' }, input, h('span', { class: 'option-body' }, text, ' ', mark)))
    return { key: item.dataset.key, item, input, text, mark }
  }

  given() {
    const keys = this.options.filter(({ input }) => input.checked).map(({ key }) => key)
    return keys.length > 0 ? keys : null
  }

  /** @returns {boolean} whether there is anything of it to show */
  show(given) {
    const keys = Array.isArray(given) ? given : []
    for (const { key, input } of this.options) input.checked = keys.includes(key)
    return this.given() !== null
  }

  clear() {
    for (const { input } of this.options) {
      input.checked = false
      input.disabled = false
    }
  }

  focus() {
    this.options[0]?.input.focus()
  }

  grade(given) {
    const { right, extra, missing } = gradeChoice(given, this.answers)
    const said = { right, state: right ? 'right' : 'wrong', feedback: given }
    if (this.predict) return { ...said, finished: true, ...this.#happened(right) }
    if (right || !this.several) return said
    return { ...said, more: fill(this.words('quiz.live.chosen'), { extra, missing }) }
  }

  /** What was predicted beside what happens. */
  #happened(right) {
    const column = (name, keys) => {
      const texts = this.options.filter(({ key }) => keys.includes(key)).map(({ text }) => h('dd', {}, ...copyOf(text)))
      return h('div', {}, h('dt', {}, this.words(name)), ...texts)
    }
    const columns = [column('quiz.live.predicted', this.given()), column('quiz.live.happens', this.answers)]
    const shown = h('dl', { class: 'outcome' }, ...columns)
    return { line: this.words(right ? 'quiz.live.as_predicted' : 'quiz.live.otherwise'), nodes: [shown], solution: false }
  }

  /** Mark the options, once something can be said of them. */
  mark(result) {
    const chosen = new Set(result?.feedback ?? [])
    for (const { key, item, input, mark } of this.options) {
      const right = this.answers.includes(key)
      const told = result?.state === 'right' || result?.finished ? right || chosen.has(key) : !this.several && chosen.has(key)
      const name = !result || !told ? '' : right ? 'right' : 'wrong'
      item.dataset.mark = name
      mark.replaceChildren(...(name ? [shape(name), this.words(`quiz.live.mark_${name}`)] : []))
      input.disabled = this.predict && Boolean(result?.finished)
    }
  }
}
