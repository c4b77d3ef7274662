/**
 * A live question: the form around the controls of its kind, its hints, its verdict, and what is kept of it.
 *
 * The page has the question with its answer behind a fold. That fold stays, for paper; on a screen its parts (the solution, the
 * explanation, what is said of an option) move into the verdict when they are due, and back. Nothing is copied, so that no id is there
 * twice.
 *
 * The controls of a kind have `body`, `given()`, `show(given)`, `clear()`, `focus()`, `grade(given)`, `mark(result)` and the text of
 * their button, `submit`. A result is `{ state, right, line, more, nodes, feedback, solution, finished }`: the verdict's first sentence
 * where it is not the usual one, what is added to it, elements below, the options whose feedback is shown, whether the solution is.
 */

import { Choices } from './choices.js'
import { Numeric, Output } from './entries.js'
import { Open } from './open.js'
import { Ordering } from './ordering.js'
import { button, fill, h, setHidden, shape } from './parts.js'

const KINDS = { mcq: Choices, several: Choices, predict: Choices, numeric: Numeric, output: Output, open: Open, order: Ordering }

/** Whether a question of the page can be answered there. One about a script that was not run has no answer. */
export function canBeLive(element) {
  const { kind, answer } = element.dataset
  return Object.hasOwn(KINDS, kind) && (kind === 'open' || answer !== undefined) && !element.classList.contains('is-live')
}

export class Question {
  /**
   * @param {HTMLElement} element the page's `.question`
   * @param {(key: string) => string} words
   * @param {(answer: object) => void} keep called with what is to be kept
   */
  constructor(element, words, keep) {
    this.element = element
    this.words = words
    this.keep = keep
    this.tries = 0
    this.hints = 0
    this.result = null
    this.dirty = false
    this.at = ''
    this.fold = element.querySelector(':scope > .answer')
    this.simulation = this.fold.querySelector(':scope > .simulation')
    this.home = [...this.fold.children].filter((child) => child.localName !== 'summary' && child !== this.simulation)
    this.control = new KINDS[element.dataset.kind](this)
    this.#build()
  }

  /** An id for a part of it; always the same, so that a page is the same whenever it came alive. */
  id(name) {
    return `_${this.element.id || this.element.dataset.question}.${name}`
  }

  // --- what is kept

  /** Show an answer of before; nothing is kept again. @returns {boolean} whether there was anything to show */
  restore({ given, tries, hints, at }) {
    this.control.clear()
    if (!this.control.show(given)) return false
    this.at = at
    this.tries = Number.isFinite(tries) ? tries : 1
    this.#openHints(Number.isFinite(hints) ? hints : 0)
    const entered = this.control.given()
    const result = this.control.grade(entered)
    this.dirty = false
    this.#set(result.state === 'unread' ? null : result)
    return true
  }

  /** As it was before any answer. */
  empty() {
    this.control.clear()
    this.tries = 0
    this.at = ''
    this.dirty = false
    this.#set(null)
  }

  /** What was entered since the last check. */
  draft() {
    return this.dirty ? this.control.given() : null
  }

  showDraft(given) {
    this.dirty = this.control.show(given)
    if (this.dirty) this.#set(null) // a verdict would be that of another answer
  }

  // --- what happens

  check() {
    if (this.checking.getAttribute('aria-disabled') === 'true') return
    const given = this.control.given()
    if (given === null) {
      const nothing = this.words(`quiz.live.nothing.${this.element.dataset.kind}`)
      return this.#set({ state: 'unread', right: null, line: nothing })
    }
    const result = this.control.grade(given)
    if (result.state !== 'unread') this.tries += 1
    this.note(result)
  }

  /** Take a result, and keep it where there is one. */
  note(result) {
    this.#set(result)
    if (result.state === 'unread') return
    this.dirty = false
    this.at = new Date().toISOString()
    this.keep({ given: this.control.given(), right: result.right, tries: this.tries, hints: this.hints, at: this.at })
  }

  reveal() {
    this.#set({ ...this.result, state: 'done', line: this.words('quiz.live.answer'), more: '', nodes: [], solution: true, finished: true })
  }

  again() {
    this.control.clear()
    this.dirty = false
    this.#set(null)
    this.control.focus()
  }

  /** The learner has changed the answer. */
  touched() {
    this.dirty = true
    const { control, result } = this
    if (result === null || (result.finished && (control.stays || control.final))) return
    const mending = control.keeps && !result.finished && result.state !== 'right'
    if (!mending) this.#set(null)
  }

  // --- how it looks

  #build() {
    const { element, control } = this
    this.verdict = h('div', { class: 'verdict', role: 'status', 'aria-atomic': 'false' })
    this.checking = h('button', { type: 'submit', class: 'quiz-button quiz-check' }, control.submit)
    this.revealing = button(this.words('quiz.live.reveal'), { hidden: true, onclick: () => this.reveal() })
    this.retrying = button(this.words('quiz.live.again'), { hidden: true, onclick: () => this.again() })
    const submit = (event) => {
      event.preventDefault()
      this.check()
    }
    const how = element.querySelector(':scope > .question-how')
    if (how) how.id = this.id('how')
    const legend = this.#legend()
    const described = [how, ...legend].filter((part) => part?.id && part.localName !== 'legend').map((part) => part.id)
    const fields = h('fieldset', { 'aria-describedby': described.join(' ') || null }, ...legend, how, control.body)
    fields.addEventListener('input', () => this.touched())
    const actions = h('div', { class: 'question-actions' }, this.checking, this.revealing, this.retrying)
    this.form = h('form', { class: 'question-form', noValidate: true, autocomplete: 'off', onsubmit: submit }, fields)
    this.form.append(...this.#takeHints(), actions, this.verdict, ...(control.below ? [control.below] : []))
    this.fold.before(this.form)
    element.classList.add('is-live')
    this.#set(null)
  }

  /** The question as the group's name: its first paragraph; the rest describes it. */
  #legend() {
    const text = this.element.querySelector(':scope > .question-text')
    const lead = [...text.childNodes].find((node) => node.nodeType !== Node.TEXT_NODE || node.data.trim() !== '')
    if (lead?.localName !== 'p') {
      text.id = this.id('text')
      const name = fill(this.words('quiz.live.question'), { n: this.element.dataset.number ?? '' })
      return [h('legend', { class: 'unseen' }, name), text]
    }
    const legend = h('legend', { id: lead.id || null, class: lead.className || null }, ...lead.childNodes)
    lead.remove()
    if (text.childElementCount > 0 || text.textContent.trim() !== '') return [legend, text]
    text.remove()
    return [legend]
  }

  /** The hints, of which each shows when the one before was opened. */
  #takeHints() {
    this.hintFolds = [...this.element.querySelectorAll(':scope > .hint')]
    this.hintFolds.forEach((fold, index) => {
      fold.classList.toggle('is-later', index > 0)
      fold.querySelector('summary').addEventListener('click', () => fold.open || this.#openHints(index + 1))
    })
    return this.hintFolds
  }

  #openHints(count) {
    this.hints = Math.min(Math.max(count, this.hints), this.hintFolds.length)
    this.hintFolds.forEach((fold, index) => fold.classList.toggle('is-later', index > this.hints))
  }

  #set(result) {
    const { control, fold, verdict } = this
    const shown = this.result
    this.result = result
    const over = result?.state === 'right' || Boolean(result?.finished)
    verdict.dataset.state = result?.state ?? ''
    if (control.stays && shown?.finished && over) verdict.firstElementChild.replaceWith(this.#line(result))
    else {
      const said = result ? [this.#line(result), ...this.#details(result, over)] : []
      fold.append(...this.home.filter((part) => !said.includes(part)))
      verdict.replaceChildren(...said)
    }
    if (this.simulation) this.#place(over)
    fold.classList.toggle('is-empty', fold.childElementCount === 1)
    control.mark(result)
    this.checking.setAttribute('aria-disabled', String(over))
    setHidden(this.retrying, !over || Boolean(control.final), this.checking)
    setHidden(this.revealing, over || this.tries === 0 || Boolean(control.final || control.stays), over ? this.retrying : this.checking)
  }

  /** The simulation, outside of the form: what is pressed there answers nothing. It is only moved where it is not yet. */
  #place(open) {
    const { simulation, fold, form } = this
    if (open && form.nextElementSibling !== simulation) form.after(simulation)
    if (!open && simulation.parentElement !== fold) fold.append(simulation)
  }

  #line(result) {
    const state = ['right', 'wrong', 'partly', 'unread'].includes(result.state) ? result.state : 'done'
    const line = result.line ?? this.words(`quiz.live.${state}`)
    return h('p', { class: 'verdict-line' }, shape(state), h('strong', {}, line), result.more ? ` ${result.more}` : null)
  }

  /** Below the line: what belongs to the options that were chosen, the solution, the explanation. */
  #details(result, over) {
    const part = (name) => this.home.filter((child) => child.classList.contains(name))
    const feedback = (result.feedback ?? []).flatMap((key) => part('feedback').filter((child) => child.dataset.key === key))
    return [...(result.nodes ?? []), ...feedback, ...(result.solution ? part('solution') : []), ...(over ? part('explain') : [])]
  }
}
