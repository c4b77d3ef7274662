/**
 * The reader's progress in pages: at the end of lessons, on maps, and on the pages about it.
 *
 * Entry point: `showProgress(document, words, progress, improve)`. Everything is drawn again after each change, also one in another
 * tab. Maps and the pages about progress have scripts of their own, which hand over their function:
 * `document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: start }))`.
 */

import { followLesson, showLesson, tickLessons } from './lesson.js'

/** The function of the page's own script. */
let start = null

/**
 * @param {(key: string) => string} words
 * @param {ReturnType<typeof import('./store.js').openProgress>} progress
 * @param {(part: Element) => void} improve called with new parts of the page
 * @returns {() => void} ends it
 */
export function showProgress(document, words, progress, improve) {
  const ends = []
  const lesson = document.querySelector('[data-progress="lesson"]')
  const id = document.querySelector('main')?.dataset.lesson
  const begin = () => ends.push(start(document, { words, progress, improve }))
  if (lesson && id) {
    const beside = document.querySelectorAll('.level-nav [data-lesson]')
    const draw = () => {
      showLesson(lesson, id, words, progress)
      tickLessons(beside, words, progress)
    }
    draw()
    ends.push(progress.onChange(draw), followLesson(document, id, progress))
  } else if (!document.querySelector(':is([data-mark], [data-progress])')) return () => {}
  else if (start) begin()
  else {
    const take = ({ detail }) => {
      start = detail
      begin()
    }
    document.addEventListener('coursebuild:reader', take, { once: true })
    ends.push(() => document.removeEventListener('coursebuild:reader', take))
  }
  // A page in the browser's back/forward cache misses storage events.
  const abort = new AbortController()
  addEventListener('pageshow', ({ persisted }) => persisted && progress.refresh(), { signal: abort.signal })
  return () => {
    abort.abort()
    ends.forEach((end) => end())
  }
}
