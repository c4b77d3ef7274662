/** The page of the reader's progress: the state of each level, and the controls to export, import and reset progress. */

import { h } from './lab/page/dom.js'
import { overview, totals } from './progress/course.js'
import { addControls } from './progress/controls.js'
import { readRows, showMark } from './progress/map.js'
import { say } from './page/words.js'

function showPage(document, { words, progress }) {
  const lessons = readRows(document)
  const place = (name) => document.querySelector(`[data-progress="${name}"]`)
  addControls(document, words, progress)
  const draw = () => {
    const withId = lessons.filter(({ id }) => id)
    const otherPages = lessons.filter(({ id }) => !id).map((page, number) => ({ ...page, id: `page ${number}` }))
    const { lessons: states, orphans } = overview([...withId, ...otherPages], progress.all(), progress.lessons())
    for (const { id, row } of [...withId, ...otherPages]) showMark(row.querySelector('[data-mark]'), states.get(id), words)
    const available = withId.filter(({ planned }) => !planned)
    showOverall(place('overall'), sumOf(available, otherPages, states), words, progress.trouble())
    for (const level of document.querySelectorAll('[data-level]')) {
      const [levelLessons, levelPages] = [available, otherPages].map((rows) => rows.filter(({ row }) => level.contains(row)))
      level.querySelector('[data-amounts]')?.replaceChildren(...amounts(sumOf(levelLessons, levelPages, states), words))
    }
    showOrphans(place('orphans'), orphans, words, progress)
  }
  draw()
  return progress.onChange(draw)
}

/** The sums over lessons, including the questions of other pages. */
function sumOf(lessons, otherPages, states) {
  const sum = totals(lessons.map(({ id }) => states.get(id)))
  const extra = totals(otherPages.map(({ id }) => states.get(id)))
  for (const name of ['questions', 'answered', 'right']) sum[name] += extra[name]
  return sum
}

function showOverall(place, sum, words, trouble) {
  const parts = []
  if (trouble) parts.push(h('p', { class: 'trouble' }, say(words, `progress.trouble.${trouble}`)))
  if (sum.begun || sum.read || sum.answered) parts.push(h('div', { class: 'amounts' }, ...amounts(sum, words)))
  else parts.push(h('p', {}, words('progress.live.none')))
  place.replaceChildren(...parts)
}

/** How many lessons are read and questions right, in words and as bars. */
function amounts(sum, words) {
  const parts = []
  if (sum.lessons) {
    const begunText = sum.begun ? `${words('site.comma')} ${say(words, 'progress.live.begun', { n: sum.begun })}` : ''
    parts.push(amount(say(words, 'progress.live.lessons', { n: sum.lessons, read: sum.read }) + begunText, sum.read, sum.lessons))
  }
  if (sum.questions) parts.push(amount(say(words, 'progress.map.questions', { n: sum.questions, right: sum.right }), sum.right, sum.questions))
  return parts
}

/** A text and a bar; the bar is hidden from screen readers, as the text says the same. */
function amount(text, value, max) {
  return h('p', { class: 'amount' }, h('progress', { value, max, 'aria-hidden': 'true' }), h('span', {}, text))
}

/** Show stored answers and lessons that the course no longer has, with buttons to forget them. @param {{answers: any[], lessons: string[]}} orphans see `overview` */
function showOrphans(place, orphans, words, progress) {
  const items = [
    ...orphans.lessons.map((id) => ({ text: say(words, 'progress.live.orphan_lesson', { id }), forget: () => progress.forgetLesson(id) })),
    ...orphans.answers.map((answer) => ({ text: answerText(answer, words), forget: () => progress.forget(answer.quiz, answer.key) })),
  ]
  const key = JSON.stringify(items.map(({ text }) => text))
  if (place.dataset.shown === key) return
  place.dataset.shown = key
  const hadFocus = place.contains(document.activeElement)
  place.hidden = items.length === 0
  place.replaceChildren(
    h('h2', { tabIndex: -1 }, words('progress.live.orphans')),
    h('p', {}, words('progress.live.orphans_text')),
    h('ul', {}, ...items.map(({ text, forget }) => h('li', {}, text, ' ', forgetButton(text, forget, words)))),
    h('p', {}, h('button', { type: 'button', class: 'quiet', onclick: () => items.forEach(({ forget }) => forget()) }, words('progress.live.forget_all'))),
  )
  // The pressed button has gone.
  if (hadFocus) (items.length > 0 ? place.querySelector('h2') : document.querySelector('h1')).focus()
}

function answerText({ quiz, number, lesson, right }, words) {
  const verdict = words(`progress.live.${right === null ? 'open' : right ? 'right' : 'wrong'}`)
  const name = lesson ? 'orphan_answer' : 'orphan_of_page'
  return `${say(words, `progress.live.${name}`, { number, quiz, lesson })} (${verdict})`
}

function forgetButton(text, forget, words) {
  const label = say(words, 'progress.live.forget_what', { what: text })
  return h('button', { type: 'button', class: 'quiet', 'aria-label': label, onclick: forget }, words('progress.live.forget'))
}

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showPage }))
