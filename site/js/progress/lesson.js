/** On the page of a lesson: notes how far it is read, and shows at its end whether it counts as read. */

import { h } from '../lab/page/dom.js'
import { currentHeading } from '../page/contents.js'
import { Reading } from './reading.js'
import { sign } from './signs.js'
import { say } from './words.js'

const SECOND = 1000
const FIRST_NOTE = 5 // seconds
const SAVE_EVERY = 5 // seconds

/** Follow the reader. @returns {() => void} ends it */
export function followLesson(document, id, progress) {
  const text = document.querySelector('.prose')
  if (!text) return () => {}
  const headings = [...text.querySelectorAll(':is(h2, h3)[id]')]
  const reading = new Reading(progress.lessons().get(id)?.place?.share ?? 0)
  let noted = ''
  let saved = 0
  const save = () => {
    const { at, title } = sectionOf(headings)
    const place = { at, title, share: reading.share }
    const now = JSON.stringify(place)
    if (now === noted || reading.seconds < FIRST_NOTE) return
    noted = now
    saved = reading.seconds
    progress.readLesson(id, place)
  }
  const look = () => {
    if (document.visibilityState !== 'visible') return
    const { top, height } = text.getBoundingClientRect()
    reading.look(-top / height, (innerHeight - top) / height)
    if (reading.isRead && !progress.lessons().get(id)?.marked) progress.markLesson(id, true)
    if (reading.seconds >= saved + SAVE_EVERY) save()
  }
  const timer = setInterval(look, SECOND)
  const ended = new AbortController()
  const hidden = () => document.visibilityState === 'hidden' && save()
  document.addEventListener('visibilitychange', hidden, { signal: ended.signal })
  addEventListener('pagehide', save, { signal: ended.signal })
  return () => {
    clearInterval(timer)
    ended.abort()
  }
}

/** The section that is being read: its anchor and title, empty above the first. */
function sectionOf(headings) {
  const heading = headings[currentHeading(headings.map((one) => one.getBoundingClientRect().top), innerHeight * 0.25)]
  return heading ? { at: heading.id, title: headingText(heading) } : { at: '', title: '' }
}

function headingText(heading) {
  const copy = heading.cloneNode(true)
  copy.querySelectorAll('a.anchor, annotation').forEach((part) => part.remove())
  return copy.textContent.replace(/\s+/g, ' ').trim()
}

/** Show at the end of a lesson whether it counts as read, with a button that says otherwise; called again after each change. */
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
  const shown = String(read)
  if (state.dataset.read !== shown) {
    state.dataset.read = shown
    state.replaceChildren(...(read ? [sign('read'), words('progress.lesson.read')] : [words('progress.lesson.unread')]))
    button.textContent = words(read ? 'progress.lesson.mark_unread' : 'progress.lesson.mark_read')
  }
  const wrong = progress.trouble()
  trouble.textContent = wrong ? say(words, `progress.trouble.${wrong}`) : ''
}
