/**
 * The page of the reader's progress: how far each level is, and the ways to save, bring in and forget what is kept.
 *
 * Entry point: `showPage(document, { words, progress })`. It gives a function that ends it.
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
    const named = lessons.filter(({ id }) => id)
    const others = lessons.filter(({ id }) => !id).map((page, number) => ({ ...page, id: `page ${number}` }))
    const { lessons: done, orphans } = overview([...named, ...others], progress.all(), progress.lessons())
    for (const { id, row } of [...named, ...others]) showMark(row.querySelector('[data-mark]'), done.get(id), words)
    const written = named.filter(({ planned }) => !planned)
    showOverall(place('overall'), sumOf(written, others, done), words, progress.trouble())
    for (const level of document.querySelectorAll('[data-level]')) {
      const [inside, beside] = [written, others].map((rows) => rows.filter(({ row }) => level.contains(row)))
      level.querySelector('[data-amounts]')?.replaceChildren(...amounts(sumOf(inside, beside, done), words))
    }
    showOrphans(place('orphans'), orphans, words, progress)
  }
  draw()
  return progress.onChange(draw)
}

/** What is done of some lessons, with the questions of other pages. */
function sumOf(lessons, others, done) {
  const sum = totals(lessons.map(({ id }) => done.get(id)))
  const more = totals(others.map(({ id }) => done.get(id)))
  for (const name of ['questions', 'answered', 'right']) sum[name] += more[name]
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
    const begun = sum.begun ? `, ${say(words, 'progress.live.begun', { n: sum.begun })}` : ''
    parts.push(amount(say(words, 'progress.live.lessons', { n: sum.lessons, read: sum.read }) + begun, sum.read, sum.lessons))
  }
  if (sum.questions) parts.push(amount(say(words, 'progress.map.questions', { n: sum.questions, right: sum.right }), sum.right, sum.questions))
  return parts
}

/** The text says it all: the bar is for the eye. */
function amount(text, value, max) {
  return h('p', { class: 'amount' }, h('progress', { value, max, 'aria-hidden': 'true' }), h('span', {}, text))
}
