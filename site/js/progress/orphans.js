/** Shows stored answers and lessons that the course no longer has, with buttons to forget them. */

import { h } from '../lab/page/dom.js'
import { say } from './words.js'

/** @param {{answers: any[], lessons: string[]}} orphans see `overview` */
export function showOrphans(place, orphans, words, progress) {
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
