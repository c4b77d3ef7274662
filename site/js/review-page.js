/**
 * The page of the review: brings back questions that were missed, one at a time, when they are due.
 *
 * A question is copied from its lesson’s page, which is fetched from the same site. It works as in the lesson, but does not show the
 * earlier answer. Pages on disk cannot be fetched: then there are links to the questions.
 */

import { h, textButton } from './lab/page/dom.js'
import { memoize } from './page/scripts.js'
import { overview } from './progress/course.js'
import { readRows } from './progress/map.js'
import { agenda } from './progress/schedule.js'
import { say } from './page/words.js'

const PAGES = 50 // that are kept

function showReview(document, { words, progress, improve }) {
  return new Review(document, words, progress, improve).start()
}

class Review {
  constructor(document, words, progress, improve) {
    this.document = document
    this.say = (key, values) => say(words, `review.live.${key}`, values)
    this.words = words
    this.progress = progress
    this.improve = improve
    this.place = document.querySelector('[data-progress="review"]')
    this.page = memoize(fetchPage, PAGES)
    this.rows = readRows(document).map((row, number) => ({ ...row, id: row.id || `page ${number}` }))
    this.running = false
  }

  start() {
    this.#showAgenda()
    return this.progress.onChange(() => this.running || this.#showAgenda())
  }

  #showAgenda(intro = []) {
    const { answers, orphans } = overview(this.rows, this.progress.all(), this.progress.lessons())
    const { due, later } = agenda(answers, Date.now())
    const lost = agenda(orphans.answers, Date.now())
    const missed = due.length + later.length > 0
    const key = due.length ? 'due' : missed ? 'none' : 'never'
    const parts = [...intro, h('p', { class: 'due', role: 'status' }, this.say(key, { n: due.length }))]
    if (due.length && this.document.location.protocol === 'file:') {
      parts.push(h('p', {}, this.say('disk')), h('ul', {}, ...due.map((item) => h('li', {}, this.#link(item)))))
    } else if (due.length) parts.push(h('p', {}, textButton(this.say('start'), () => this.#run(due), 'button')))
    const laterTexts = later.map(({ days, count }) => this.say('later', { n: count, days: this.say('days', { n: days }) }))
    if (laterTexts.length) parts.push(h('p', { class: 'later' }, laterTexts.join(' ')))
    const lostCount = lost.due.length + lost.later.reduce((sum, { count }) => sum + count, 0)
    if (lostCount) parts.push(h('p', { class: 'later' }, this.say('orphans', { n: lostCount })))
    const problem = this.progress.trouble()
    if (problem) parts.push(h('p', { class: 'trouble' }, say(this.words, `progress.trouble.${problem}`)))
    this.place.replaceChildren(...parts)
  }

  // --- one question after the other

  #run(due) {
    this.running = true
    this.right = 0
    this.answered = 0
    this.#showQuestion(due, 0)
  }

  async #showQuestion(due, index) {
    if (index === due.length) return this.#finish()
    const item = due[index]
    const heading = h('h2', { tabIndex: -1, class: 'review-count' }, this.say('count', { number: index + 1, n: due.length }))
    const row = this.rows.find(({ id }) => id === item.page)
    const origin = h('p', { class: 'review-from' }, `${this.say('from')} `, h('a', { href: row.link.href }, row.link.textContent), ' ')
    origin.append(h('span', { class: 'review-box' }, this.say('box', { number: item.box + 1 })))
    const body = h('div', { class: 'review-question', 'aria-busy': 'true' }, h('p', {}, this.say('loading')))
    const next = textButton(this.say('skip'), () => this.#leave(body, due, index + 1), 'quiet')
    const end = textButton(this.say('end'), () => this.#leave(body, due, due.length), 'quiet')
    this.place.replaceChildren(heading, origin, body, h('p', { class: 'review-actions' }, next, ' ', end))
    heading.focus()
    const content = await this.#load(item, row)
    if (!body.isConnected) return
    body.removeAttribute('aria-busy')
    body.replaceChildren(content.part)
    if (content.question) this.#mount(content, item, next)
  }

  async #load(item, row) {
    try {
      const { href } = row.link
      const result = takeQuestion(await this.page(href), href, item.quiz, item.question, this.say('lab'))
      if (result) return { part: result.section, question: result.question }
      return { part: h('p', {}, this.say('moved')), question: null }
    } catch {
      return { part: h('p', {}, `${this.say('failed')} `, this.#link(item)), question: null }
    }
  }

  #mount({ part, question }, item, next) {
    const { progress } = this
    let last = null
    let isFirstVerdict = true
    if (item.key !== item.question) progress.rename(item.quiz, item.key, item.question)
    const recorder = {
      put: (quiz, key, answer) => {
        const recall = last === null || last.tries !== answer.tries || last.right !== answer.right
        last = answer
        progress.put(quiz, key, { ...answer, lesson: item.lesson }, { recall })
        if (answer.right === null) return
        if (isFirstVerdict) {
          this.answered += 1
          this.right += Number(answer.right)
        }
        isFirstVerdict = false
        next.textContent = this.say('next')
      },
    }
    globalThis.coursebuildQuizzes?.mountQuestion(question, this.words, recorder, { fresh: true })
    this.improve(part)
  }

  #leave(body, due, index) {
    globalThis.coursebuildQuizzes?.leaveQuizzes(body)
    this.#showQuestion(due, index)
  }

  #finish() {
    this.running = false
    const text = this.answered ? [this.say('done', { n: this.answered, right: this.right })] : []
    const heading = h('h2', { tabIndex: -1 }, ...text)
    this.#showAgenda(text.length ? [heading] : [])
    const focused = text.length ? heading : this.place.querySelector('button') ?? this.document.querySelector('h1')
    if (focused.localName === 'h1') focused.tabIndex = -1
    focused.focus()
  }

  #link({ quiz, question, number, page }) {
    const row = this.rows.find(({ id }) => id === page)
    const address = `${row.link.href}#${encodeURIComponent(`${quiz}.${question}`)}`
    return h('a', { href: address }, `${row.link.textContent}: ${this.say('to_lesson', { number })}`)
  }
}

/**
 * A question that this page can show: alone in its quiz, with its addresses resolved, and with links to the lesson in place of
 * simulations.
 * @param {Document} page of the lesson @param {string} address its address
 * @param {string} lab the text of that link
 * @returns {{section: HTMLElement, question: HTMLElement} | null} `null` if the page has no such question
 */
function takeQuestion(page, address, quiz, key, lab) {
  const source = [...page.querySelectorAll('[data-quiz]')].find((section) => section.dataset.quiz === quiz)
  const original = [...(source?.querySelectorAll('[data-question]') ?? [])].find((candidate) => candidate.dataset.question === key)
  if (!original) return null
  const question = document.importNode(original, true)
  resolveAddresses(question, address)
  for (const element of question.querySelectorAll('[data-lab]')) {
    element.replaceWith(h('p', {}, h('a', { href: `${address}#${encodeURIComponent(question.id)}` }, lab)))
  }
  const list = h('ol', { class: 'questions' }, question)
  return { section: h('section', { class: 'quiz', 'data-quiz': quiz }, list), question }
}

async function fetchPage(address) {
  const response = await fetch(address)
  if (!response.ok) throw new Error(`${response.status}`)
  return new DOMParser().parseFromString(await response.text(), 'text/html')
}

function resolveAddresses(part, address) {
  for (const name of ['href', 'src', 'data-config', 'data-script', 'data-editor']) {
    for (const element of part.querySelectorAll(`[${name}]`)) {
      const value = element.getAttribute(name)
      const inside = value.startsWith('#') && part.querySelector(`#${CSS.escape(value.slice(1))}`)
      if (!inside) element.setAttribute(name, new URL(value, address).href)
    }
  }
}

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showReview }))
