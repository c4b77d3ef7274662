/** On a lesson's page: records how far it is read, shows at its end whether it counts as read, and ticks the lessons beside it. */

import { h } from '../lab/page/dom.js'
import { currentHeading } from '../page/contents.js'
import { textWithout } from '../page/select.js'
import { Reading } from './reading.js'
import { sign } from './signs.js'
import { say } from '../page/words.js'

const SECOND = 1000
const FIRST_NOTE = 5 // seconds before a place is recorded
const SAVE_EVERY = 5 // seconds

/** Follow the reader. @returns {() => void} ends it */
export function followLesson(document, id, progress) {
  const text = document.querySelector('.prose')
  if (!text) return () => {}
  const headings = [...text.querySelectorAll(':is(h2, h3)[id]')]
  const reading = new Reading(progress.lessons().get(id)?.place?.share ?? 0)
  let lastPlace = ''
  let lastSave = 0
  const save = () => {
    const { anchor, title } = sectionOf(headings)
    const place = { anchor, title, share: reading.share }
    const now = JSON.stringify(place)
    if (now === lastPlace || reading.seconds < FIRST_NOTE) return
    lastPlace = now
    lastSave = reading.seconds
    progress.readLesson(id, place)
  }
  const look = () => {
    if (document.visibilityState !== 'visible') return
    const { top, height } = text.getBoundingClientRect()
    reading.look(-top / height, (innerHeight - top) / height)
    // The button keeps its meaning under the pointer: who goes to press "Mark as read" would else press its opposite.
    const isAimedAt = document.querySelector('[data-progress="lesson"] button:hover') !== null
    if (reading.isRead && !isAimedAt && !progress.lessons().get(id)?.marked) progress.markLesson(id, true)
    const detail = { section: sectionOf(headings).anchor, isRead: reading.isRead }
    document.dispatchEvent(new CustomEvent('coursebuild:reading', { detail })) // for the frame of a learning platform
    if (reading.seconds >= lastSave + SAVE_EVERY) save()
  }
  const timer = setInterval(look, SECOND)
  const abort = new AbortController()
  const hidden = () => document.visibilityState === 'hidden' && save()
  document.addEventListener('visibilitychange', hidden, { signal: abort.signal })
  addEventListener('pagehide', save, { signal: abort.signal })
  return () => {
    clearInterval(timer)
    abort.abort()
  }
}

/** The current section: its anchor and title, empty above the first. */
function sectionOf(headings) {
  const heading = headings[currentHeading(headings.map((element) => element.getBoundingClientRect().top), innerHeight * 0.25)]
  return heading ? { anchor: heading.id, title: textWithout(heading, 'a.anchor, annotation') } : { anchor: '', title: '' }
}

/** Show at the end of a lesson whether it counts as read, with a button to change that; called again after each change. */
export function showLesson(place, id, words, progress) {
  const read = progress.lessons().get(id)?.read ?? false
  if (!place.firstChild) {
    const toggle = () => progress.markLesson(id, !(progress.lessons().get(id)?.read ?? false))
    place.append(
      h('p', { class: 'lesson-read', role: 'status' }),
      h('button', { type: 'button', class: 'quiet', onclick: toggle }),
      h('p', { class: 'lesson-trouble' }),
    )
  }
  const [state, button, trouble] = place.children
  const key = String(read)
  if (state.dataset.read !== key) {
    state.dataset.read = key
    state.replaceChildren(...(read ? [sign('read'), words('progress.lesson.read')] : [words('progress.lesson.unread')]))
    button.textContent = words(read ? 'progress.lesson.mark_unread' : 'progress.lesson.mark_read')
  }
  const problem = progress.trouble()
  trouble.textContent = problem ? say(words, `progress.trouble.${problem}`) : ''
}

/** Tick the lessons that are read, in the list beside the text; called again after each change. */
export function tickLessons(links, words, progress) {
  const lessons = progress.lessons()
  for (const link of links) {
    const read = lessons.get(link.dataset.lesson)?.read ?? false
    const tick = link.querySelector('.tick')
    if (!read) tick?.remove()
    else if (!tick) link.append(h('span', { class: 'tick' }, sign('read'), h('span', { class: 'unseen' }, ` ${words('progress.map.read')}`)))
  }
}
