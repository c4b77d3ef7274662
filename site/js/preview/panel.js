/**
 * The course's mistakes, over the page: a small button in the corner shows the state and opens the list.
 *
 * The list begins closed, and closes when the last mistake is corrected. Mistakes of this page come first, each with a link to its
 * place.
 */

import { h } from '../lab/page/dom.js'
import { formatCode, offerButton, OF_THE_TOOL, verdict } from './elements.js'
import { showMistake } from './marks.js'
import { timesOf } from './times.js'

const PATIENCE = 600 // ms

/** The text of the button. */
export function summary(say, { problems, busy, trouble, running }, lost, isGone) {
  const errors = problems.filter(({ severity }) => severity === 'error').length
  const warnings = problems.filter(({ severity }) => severity === 'warning').length
  const parts = []
  if (lost) parts.push(say('lost'))
  if (isGone) parts.push(say('gone'))
  if (trouble) parts.push(say('trouble'))
  if (errors) parts.push(say('errors', { n: errors }))
  if (warnings) parts.push(say('warnings', { n: warnings }))
  const longest = running.map((script) => ({ path: script.path, ...timesOf(script) })).sort((a, b) => (b.left ?? 0) - (a.left ?? 0))[0]
  if (busy && !lost) parts.push(longest?.left ? say('left', longest) : `${busy} …`)
  return parts.join(', ')
}

export class Panel {
  /** `openPlace(place)` opens a place in the editor, `accept(ids)` accepts what is offered; each promises why it could not, or nothing. */
  constructor(say, openPlace, accept) {
    this.say = say
    this.openPlace = openPlace
    this.accept = accept
    this.folder = '' // of the course, where places are links for an editor
    this.news = { problems: [], more: 0, busy: '', trouble: '', running: [], outputs: [], figures: [], numbers: [] }
    this.lost = false
    this.gone = false
    this.open = false
    this.button = h('button', { type: 'button', class: 'preview-button', 'aria-expanded': 'false', onclick: () => this.toggle() })
    this.all = h('button', { type: 'button', class: 'preview-accept preview-all', hidden: true, onclick: () => this.acceptAll() })
    this.why = h('p', { class: 'preview-why preview-answer', role: 'status', hidden: true })
    this.status = h('span', { class: 'unseen', role: 'status' })
    this.list = h('section', { class: 'preview-panel', 'aria-label': say('problems'), tabIndex: -1 })
    this.root = h('div', { class: 'preview-own' }, this.list, this.why, this.all, this.button, this.status)
    this.root.addEventListener('keydown', (event) => {
      if (event.key === 'Escape' && this.open) this.toggle()
    })
    document.documentElement.append(this.root)
    setInterval(() => this.news.running.length && this.draw(), 1000)
    this.draw()
  }

  show(news) {
    // Short work is not worth a message.
    clearTimeout(this.timer)
    if (news.busy && !this.news.busy) {
      this.timer = setTimeout(() => this.take(news), PATIENCE)
      return this.take({ ...news, busy: '' })
    }
    this.take(news)
  }

  take(news) {
    this.news = news
    if (news.problems.length === 0 && !news.trouble) this.open = false
    this.draw()
  }

  setState({ lost = this.lost, gone = this.gone, folder = this.folder }) {
    Object.assign(this, { lost, gone, folder })
    this.draw()
  }

  toggle() {
    this.open = !this.open
    this.draw()
    if (this.open) this.list.focus()
    else this.button.focus()
  }

  draw() {
    const text = summary(this.say, this.news, this.lost, this.gone)
    const hasProblems = this.news.problems.length > 0 || this.news.trouble !== ''
    const key = JSON.stringify([text, this.open, this.news, this.gone, this.folder])
    if (key === this.drawnKey) return
    this.drawnKey = key
    const offers = this.offers()
    this.all.hidden = offers.length < 2
    this.all.textContent = this.say('accept_all', { n: offers.length })
    if (offers.length < 2) this.why.hidden = true
    this.button.hidden = text === ''
    this.button.textContent = text
    this.button.disabled = !hasProblems && !this.gone
    this.button.classList.toggle('preview-bad', this.lost || this.gone || this.news.problems.some(({ severity }) => severity === 'error'))
    this.button.setAttribute('aria-expanded', String(this.open))
    this.status.textContent = hasProblems || this.gone || this.lost ? text : ''
    this.list.hidden = !this.open
    this.list.replaceChildren(...(this.open ? this.makeContent() : []))
  }

  /** The ids of all that the page offers. */
  offers() {
    const { outputs, figures, numbers } = this.news
    return [...outputs, ...figures, ...numbers].flatMap(({ offer }) => offer ?? [])
  }

  async acceptAll() {
    this.all.disabled = true
    const refusal = await this.accept(this.offers().join(' '))
    this.all.disabled = false
    this.why.hidden = !refusal
    this.why.textContent = refusal ? this.say('not_written', { reason: refusal }) : ''
  }

  makeContent() {
    const { problems, more, trouble } = this.news
    const here = problems.filter((problem) => problem.here)
    const elsewhere = problems.filter((problem) => !problem.here)
    const close = h('button', { type: 'button', class: 'preview-close', onclick: () => this.toggle() }, this.say('close'))
    const parts = [h('div', { class: 'preview-head' }, h('p', { class: 'preview-title' }, this.say(here.length ? 'here' : 'wrong')), close)]
    if (trouble) parts.push(h('pre', { class: 'preview-trouble', ...OF_THE_TOOL }, trouble))
    if (here.length) parts.push(this.makeList(here))
    if (here.length && elsewhere.length) parts.push(h('p', { class: 'preview-title preview-further' }, this.say('elsewhere')))
    if (elsewhere.length) parts.push(this.makeList(elsewhere))
    if (more) parts.push(h('p', {}, this.say('more', { n: more })))
    return parts
  }

  makeList(problems) {
    return h('ol', { class: 'preview-problems' }, ...problems.map((problem) => this.makeProblem(problem)))
  }

  makeProblem({ severity, rule, place, message, label, help, notes, choices, line, start, end, mark, offer, fixed }) {
    const item = h('li', { class: `preview-problem preview-${severity}` })
    item.append(h('p', { class: 'preview-message' }, ...verdict(this.say, severity, message)), this.makePlace(place, rule))
    if (mark) item.append(h('p', {}, this.makeLink(mark)))
    if (line.trim()) {
      const excerpt = h('mark', {}, line.slice(start, Math.max(end, start + 1)) || '\u00a0')
      item.append(h('pre', { class: 'preview-source', tabIndex: 0, dir: 'ltr' }, line.slice(0, start), excerpt, line.slice(Math.max(end, start + 1))))
    }
    if (label) item.append(h('p', { class: 'preview-label', ...OF_THE_TOOL }, ...formatCode(label)))
    for (const { text, offer: choice } of choices) item.append(h('p', OF_THE_TOOL, ...formatCode(text)), ...this.makeFix(choice, ''))
    for (const note of notes) item.append(h('pre', { class: 'preview-note', ...OF_THE_TOOL }, note))
    if (help) item.append(h('p', { class: 'preview-help', ...OF_THE_TOOL }, ...formatCode(help)))
    if (offer) item.append(...this.makeFix(offer, fixed))
    return item
  }

  /** A link to the place of a mistake on the page, which closes the list. */
  makeLink(mark) {
    const show = (event) => {
      event.preventDefault()
      this.toggle()
      showMistake(mark)
    }
    return h('a', { class: 'preview-show', href: `#${mark}`, onclick: show }, this.say('show'))
  }

  /** The line as a fix writes it, and the button that does. */
  makeFix(offer, line) {
    const written = h('pre', { class: 'preview-source', tabIndex: 0, dir: 'ltr' }, h('ins', {}, line))
    const act = h('p', {}, ...offerButton(this.say('fix'), this.say, () => this.accept(offer)))
    return line.trim() ? [written, act] : [act]
  }

  makePlace(text, rule) {
    if (this.folder) {
      const link = h('a', { href: editorLink(this.folder, text), title: this.say('open') }, h('code', {}, text))
      return h('p', { class: 'preview-place', dir: 'ltr' }, link, ` ${rule}`)
    }
    const answer = h('span', { class: 'preview-why', role: 'status' })
    const button = h('button', { type: 'button', title: this.say('open') }, h('code', {}, text))
    button.addEventListener('click', async () => {
      const refusal = await this.openPlace(text)
      answer.replaceChildren(...(refusal ? formatCode(this.say('not_opened', { reason: refusal })) : []))
    })
    return h('p', { class: 'preview-place', dir: 'ltr' }, button, ` ${rule} `, answer)
  }
}

/** A link by which a browser asks Visual Studio Code to open a place, such as `content/a.md:3:5`. */
export const editorLink = (folder, place) => `vscode://file${`${folder}/${place}`.split('/').map(encodeURIComponent).join('/').replaceAll('%3A', ':')}`

