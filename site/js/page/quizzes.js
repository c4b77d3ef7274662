/**
 * Quizzes come alive when they come near. Their script is a plain one, `quiz.js`, since browsers load no modules from a disk; it offers
 * what it can do as `coursebuildQuizzes`. Until it is there, and where it does not arrive, questions have their answers behind folds.
 */

import { within } from './within.js'

const NEAR = '800px 0px' // of the window's edge

const waiting = new Set() // parts of the page, each with what is to be done
let begun = false

/**
 * @param {Document | Element} part of the page
 * @param {(key: string) => string} words
 * @param {object} progress see progress/store.js
 */
export function mountQuizzes(part, words, progress) {
  const questions = within(part, '.question[data-question]')
  if (questions.length === 0) return
  const mount = () => globalThis.coursebuildQuizzes.mountQuizzes(part, words, progress)
  if (globalThis.coursebuildQuizzes) return mount()
  waiting.add({ part, mount })
  const near = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return
      near.disconnect()
      load()
    },
    { rootMargin: NEAR },
  )
  questions.forEach((question) => near.observe(question))
}

/** End what was begun for a part that has gone from the page. */
export function leaveQuizzes(part) {
  globalThis.coursebuildQuizzes?.leaveQuizzes(part)
  for (const one of waiting) if (one.part === part) waiting.delete(one)
}

function load() {
  const address = document.getElementById('_words')?.dataset.quizScript
  if (begun || !address) return
  begun = true
  const script = document.createElement('script')
  script.src = new URL(address, document.baseURI).href
  script.addEventListener('load', () => {
    for (const { mount } of waiting) mount()
    waiting.clear()
  })
  script.addEventListener('error', () => (begun = false))
  document.head.append(script)
}
