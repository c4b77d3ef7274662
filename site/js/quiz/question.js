/**
 * A live question: the form around the control of its kind, its hints, its verdict, and its stored answer.
 *
 * The page has the question with its answer behind a fold. That fold stays, for print; on a screen its parts (the solution, the
 * explanation, the feedback to options) move into the verdict when they are due, and back. Nothing is copied, so that no id occurs
 * twice.
 *
 * The control of a kind has `body`, `entry()`, `show(entry)` (nothing, if it is null), `focus()`, `grade(entry)`, `mark(result)` and the text of
 * its button, `submit`. A result is `{ state, right, line, more, nodes, feedback, solution, finished }`: `line` replaces the verdict's
 * usual sentence, `more` is added to it, `nodes` come below; `feedback` lists the options whose feedback is shown, and `solution` says
 * whether the solution is.
 */

import { textButton } from '../lab/page/dom.js'
import { Choices } from './choices.js'
import { Numeric, Open, Output } from './entries.js'
import { Ordering } from './ordering.js'
import { fill, h, setHidden, shape } from './parts.js'

const KINDS = { mcq: Choices, several: Choices, predict: Choices, numeric: Numeric, output: Output, open: Open, order: Ordering }

/** Whether a question can be answered in the page. One about a script that was not run has no answer. */
export function canBeLive(element) {
  const { kind, answer } = element.dataset
  return Object.hasOwn(KINDS, kind) && (kind === 'open' || answer !== undefined) && !element.classList.contains('is-live')
}

export class Question {
  /**
   * @param {HTMLElement} element the page's `.question`
   * @param {(key: string) => string} words
   * @param {(answer: Record<string, any>) => void} keep called with each answer that is to be stored
   */
  constructor(element, words, keep) {
    this.element = element
    this.words = words
    this.keep = keep
    this.tries = 0
    this.hints = 0
    this.result = null
    this.dirty = false
    this.savedAt = ''
    this.fold = element.querySelector(':scope > .answer')
    this.simulation = this.fold.querySelector(':scope > .simulation')
    this.home = [...this.fold.children].filter((child) => child.localName !== 'summary' && child !== this.simulation)
    this.control = new KINDS[element.dataset.kind](this)
    this.#build()
  }

  /** The id of a part of the question; it does not depend on when the question was mounted. */
  id(name) {
    return `_${this.element.id || this.element.dataset.question}.${name}`
  }

  // --- stored answers

  /** Show a stored answer, without storing it again. @returns {boolean} whether there was anything to show */
  restore({ given: entry, tries, hints, at }) {
    if (!this.control.show(entry)) return false
    this.savedAt = at
    this.tries = Number.isFinite(tries) ? tries : 1
    this.#openHints(Number.isFinite(hints) ? hints : 0)
    const entered = this.control.entry()
    const result = this.control.grade(entered)
    this.dirty = false
    this.#set(result.state === 'unread' ? null : result)
    return true
  }

  /** Reset the question to its state before any answer. */
  empty() {
    this.control.show(null)
    this.tries = 0
    this.savedAt = ''
    this.dirty = false
    this.#set(null)
  }

  /** The entry, if it has changed since the last check, else null. */
  draft() {
    return this.dirty ? this.control.entry() : null
  }

  showDraft(entry) {
    this.dirty = this.control.show(entry)
    if (this.dirty) this.#set(null) // the verdict was that of another answer
  }

  // --- actions

  check() {
    if (this.checking.getAttribute('aria-disabled') === 'true') return
    const entry = this.control.entry()
    if (entry === null) {
      const message = this.words(`quiz.live.nothing.${this.element.dataset.kind}`)
      return this.#set({ state: 'unread', right: null, line: message })
    }
    const result = this.control.grade(entry)
    if (result.state !== 'unread') this.tries += 1
    this.note(result)
  }

  /** Show a result, and store the answer unless it was unreadable. */
  note(result) {
    this.#set(result)
    if (result.state === 'unread') return
    this.dirty = false
    this.savedAt = new Date().toISOString()
    this.keep({ given: this.control.entry(), right: result.right, tries: this.tries, hints: this.hints, at: this.savedAt })
  }

  reveal() {
    this.#set({ ...this.result, state: 'done', line: this.words('quiz.live.answer'), more: '', nodes: [], solution: true, finished: true })
  }

  retry() {
    this.control.show(null)
    this.dirty = false
    this.#set(null)
    this.control.focus()
  }

  /** The learner has changed the answer. */
  onEdit() {
    this.dirty = true
    const { control, result } = this
    if (result === null || (result.finished && (control.keepsReference || control.final))) return
    const isMending = control.keepsVerdict && !result.finished && result.state !== 'right'
    if (!isMending) this.#set(null)
  }

  // --- elements

  #build() {
    const { element, control } = this
    this.verdict = h('div', { class: 'verdict', role: 'status', 'aria-atomic': 'false' })
    this.checking = h('button', { type: 'submit', class: 'quiz-button quiz-check' }, control.submit)
    this.revealing = textButton(this.words('quiz.live.reveal'), () => this.reveal(), 'quiz-button')
    this.retrying = textButton(this.words('quiz.live.again'), () => this.retry(), 'quiz-button')
    const submit = (event) => {
      event.preventDefault()
      this.check()
    }
    const instructions = element.querySelector(':scope > .question-how')
    if (instructions) instructions.id = this.id('how')
    const legend = this.#legend()
    const describedBy = [instructions, ...legend].filter((part) => part?.id && part.localName !== 'legend').map((part) => part.id)
    const fields = h('fieldset', { 'aria-describedby': describedBy.join(' ') || null }, ...legend, instructions, control.body)
    fields.addEventListener('input', () => this.onEdit())
    const actions = h('div', { class: 'question-actions' }, this.checking, this.revealing, this.retrying)
    this.form = h('form', { class: 'question-form', noValidate: true, autocomplete: 'off', onsubmit: submit }, fields)
    this.form.append(...this.#takeHints(), actions, this.verdict, ...(control.footer ? [control.footer] : []))
    this.fold.before(this.form)
    element.classList.add('is-live')
    this.#set(null)
  }

  /** The legend that names the group: the question's first paragraph; the rest describes the group. */
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

  /** The hints; each is shown once the one before is opened. */
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
    const previous = this.result
    this.result = result
    const isOver = result?.state === 'right' || Boolean(result?.finished)
    verdict.dataset.state = result?.state ?? ''
    if (control.keepsReference && previous?.finished && isOver) verdict.firstElementChild.replaceWith(this.#line(result))
    else {
      const nodes = result ? [this.#line(result), ...this.#details(result, isOver)] : []
      fold.append(...this.home.filter((part) => !nodes.includes(part)))
      verdict.replaceChildren(...nodes)
    }
    if (this.simulation) this.#place(isOver)
    fold.classList.toggle('is-empty', fold.childElementCount === 1)
    control.mark(result)
    this.checking.setAttribute('aria-disabled', String(isOver))
    setHidden(this.retrying, !isOver || Boolean(control.final), this.checking)
    setHidden(this.revealing, isOver || this.tries === 0 || Boolean(control.final || control.keepsReference), isOver ? this.retrying : this.checking)
  }

  /** Put the simulation after the form, so that its buttons do not submit it, or back into the fold; only if it is not there yet. */
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

  /** The parts below the line: feedback to the chosen options, the solution, the explanation. */
  #details(result, isOver) {
    const part = (name) => this.home.filter((child) => child.classList.contains(name))
    const feedback = (result.feedback ?? []).flatMap((key) => part('feedback').filter((child) => child.dataset.key === key))
    return [...(result.nodes ?? []), ...feedback, ...(result.solution ? part('solution') : []), ...(isOver ? part('explain') : [])]
  }
}
