/**
 * Marks lessons on the course map and on the pages of levels, and links to where to go on.
 *
 * Entry point: `showMap(document, { words, progress })`, which returns a function that ends it.
 */

import { h } from '../lab/page/dom.js'
import { textWithout } from '../page/select.js'
import { markOf, nextUp, overview, readQuizzes, totals } from './course.js'
import { sign } from './signs.js'
import { say } from '../page/words.js'

/** The lessons that a page lists: their rows, in order. */
export function readRows(part) {
  return [...part.querySelectorAll(':is([data-lesson], [data-quizzes]):not(main)')].map((row) => ({
    id: row.dataset.lesson ?? '',
    quizzes: readQuizzes(row.dataset.quizzes),
    row,
    link: row.querySelector('a[href]'),
    planned: row.classList.contains('row-planned'),
  }))
}

export function showMap(document, { words, progress }) {
  const draw = () => drawMap(document, words, progress)
  draw()
  return progress.onChange(draw)
}

function drawMap(document, words, progress) {
  const lessons = readRows(document).filter(({ id }) => id)
  const storedLessons = progress.lessons()
  const { lessons: states } = overview(lessons, progress.all(), storedLessons)
  for (const { id, row } of lessons) showMark(row.querySelector('[data-mark]'), states.get(id), words)
  const open = lessons.filter(({ planned }) => !planned)
  showSummary(document.querySelector('[data-progress="summary"]'), totals(open.map(({ id }) => states.get(id))), words)
  showStart(document.querySelector('[data-progress="start"]'), open, nextUp(open.map(({ id }) => id), progress.last(), storedLessons), words)
}

/** The mark of a lesson: a sign, a word, and how many of its questions are right once one is answered. */
export function showMark(place, state, words) {
  if (!place) return
  const mark = markOf(state)
  if (!mark) return place.replaceChildren()
  const parts = [sign(mark), h('span', { class: 'mark-word' }, words(`progress.map.${mark}`))]
  if (state.answered) {
    parts.push(
      h('span', { class: 'mark-count', 'aria-hidden': 'true' }, `${state.right}/${state.questions}`),
      h('span', { class: 'unseen' }, `${words('site.comma')} ${say(words, 'progress.map.questions', { n: state.questions, right: state.right })}`),
    )
  }
  place.replaceChildren(...parts)
}

function showSummary(place, sum, words) {
  if (!place) return
  const parts = []
  const part = (name, text) => parts.push(h('span', { class: 'mark' }, sign(name), text))
  if (sum.read || sum.begun) part('read', say(words, 'progress.map.lessons_read', { n: sum.lessons, read: sum.read }))
  if (sum.begun) part('begun', say(words, 'progress.map.lessons_begun', { n: sum.begun }))
  if (sum.answered) part('right', say(words, 'progress.map.questions', { n: sum.questions, right: sum.right }))
  place.replaceChildren(...parts)
}

/** Let the button of the home page lead to where the reader was. */
function showStart(place, lessons, next, words) {
  if (!place) return
  const button = place.querySelector('a')
  const note = place.querySelector('[data-note]')
  button.dataset.text ??= button.textContent
  button.dataset.href ??= button.getAttribute('href')
  const target = lessons.find(({ id }) => id === next?.id)
  if (!target) {
    button.textContent = button.dataset.text
    button.setAttribute('href', button.dataset.href)
    note.textContent = next === 'all' ? words('progress.map.all_read') : ''
    return
  }
  const title = `${target.id} ${textWithout(target.link, '.number')}`
  button.textContent = say(words, 'progress.map.continue', { title })
  button.setAttribute('href', target.link.getAttribute('href') + (next.section ? `#${encodeURIComponent(next.section)}` : ''))
  note.textContent = next.title ? say(words, 'progress.map.at_section', { section: next.title }) : ''
}
