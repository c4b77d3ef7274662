/** The lesson's pages in the frame: where questions and their answers are found in them. */

import { Reading } from '../progress/reading.js'

const SECOND = 1000

/**
 * Follow what is shown in a frame.
 * @param {HTMLIFrameElement} frame
 * @param {string} lesson its id
 * @param {{shows: Function, answered: Function, wasRead: Function, isAt: Function}} visit
 * @param {() => void} done called after each change
 */
export function followFrame(frame, lesson, visit, done) {
  let timer = 0
  const begin = () => {
    clearInterval(timer)
    const { document } = frame.contentWindow
    document.addEventListener('coursebuild:answered', ({ detail: { quiz, key, answer } }) => {
      visit.answered(quiz, key, answer)
      done()
    })
    if (document.querySelector('main')?.dataset.lesson !== lesson) return
    visit.shows(questionsOf(document))
    timer = followReading(frame.contentWindow, visit, done)
    done()
  }
  frame.addEventListener('load', begin)
}

/** The questions of a page, as `answers.js` knows them. */
export function questionsOf(document) {
  return [...document.querySelectorAll('.question[data-question]')].map((element) => {
    const { question: key, kind, answer } = element.dataset
    const quiz = element.closest('[data-quiz]')?.dataset.quiz ?? ''
    const parts = [...element.querySelectorAll('[data-key]')].map(({ dataset }) => dataset.key)
    // Items stand as the learner has put them: their signs must not depend on that.
    if (kind === 'order') parts.sort()
    return { quiz, key, kind, parts, answer: kind === 'open' ? null : answer ?? null }
  })
}

function followReading(window, visit, done) {
  const text = window.document.querySelector('.prose')
  if (!text) return 0
  const reading = new Reading()
  const headings = [...text.querySelectorAll(':is(h2, h3)[id]')]
  const look = () => {
    if (window.document.visibilityState !== 'visible') return
    const { top, height } = text.getBoundingClientRect()
    reading.look(-top / height, (window.innerHeight - top) / height)
    const above = headings.filter((heading) => heading.getBoundingClientRect().top <= window.innerHeight / 4)
    visit.isAt(above.at(-1)?.id ?? '')
    if (!reading.isRead) return
    visit.wasRead()
    done()
  }
  return setInterval(look, SECOND)
}
