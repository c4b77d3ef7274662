/**
 * The page of the reader's progress: the state of each level, and the controls to export, import and reset progress.
 *
 * Entry point: `showPage(document, { words, progress })`, which returns a function that ends it.
 */

import { h } from '../lab/page/dom.js'
import { overview, totals } from './course.js'
import { addControls } from './controls.js'
import { readRows, showMark } from './map.js'
import { showOrphans } from './orphans.js'
import { say } from './words.js'

export function showPage(document, { words, progress }) {
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
