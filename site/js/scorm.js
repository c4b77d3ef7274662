/**
 * The page that a learning platform opens for a lesson: it shows the lesson in a frame, and speaks SCORM 1.2 for it.
 *
 * The pages in the frame are those of the site. A visit lasts as long as this page: following a link to the glossary or to another
 * lesson does not end it, and answers on other lessons' pages do not count for this lesson.
 */

import { openStorage } from './page/choices.js'
import { openProgress } from './progress/store.js'
import { findApi } from './scorm/find.js'
import { followFrame } from './scorm/frame.js'
import { beginSession } from './scorm/session.js'
import { Visit } from './scorm/visit.js'

const { course } = document.documentElement.dataset
const main = document.querySelector('main')
const { lesson, src } = main.dataset
const frame = main.querySelector('iframe')
const notice = main.querySelector('[role="status"]')

/** Show one of the page's sentences, or none. */
function say(name) {
  notice.hidden = name === ''
  notice.textContent = name && notice.dataset[name]
}

function begin() {
  const api = findApi(window)
  const session = api && beginSession(api)
  if (!session) {
    say('alone')
    frame.src = src
    return
  }
  const visit = new Visit(session, { lesson, course }, openProgress(course), openStorage())
  const check = () => say(session.trouble.length ? 'unkept' : '')
  followFrame(frame, lesson, visit, check)
  addEventListener('pagehide', () => visit.ends())
  // The browser may restore the page from its cache after the visit has ended.
  addEventListener('pageshow', ({ persisted }) => persisted && location.reload())
  frame.src = session.location ? `${src}#${encodeURIComponent(session.location)}` : src
}

begin()
