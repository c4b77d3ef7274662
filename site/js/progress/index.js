/**
 * The reader's progress in the pages: the end of lessons, marks on maps, and the pages that are about it.
 *
 * Entry point: `showProgress(document, words, progress, improve)`. Everything that it shows is drawn again after each change, also one
 * that was made in another tab. What maps and the pages about the reader need comes in scripts of their own, which hand over what is to
 * be called: `document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: start }))`.
 */

import { followLesson, showLesson } from './lesson.js'

/** What the page's own script has handed over. */
let start = null

/**
 * @param {(key: string) => string} words
 * @param {ReturnType<import('./store.js').openProgress>} progress
 * @param {(part: Element) => void} improve what is done with new parts of the page
 * @returns {() => void} ends it
 */
export function showProgress(document, words, progress, improve) {
  const ends = []
  const lesson = document.querySelector('[data-progress="lesson"]')
  const id = document.querySelector('main')?.dataset.lesson
  const begin = () => ends.push(start(document, { words, progress, improve }))
  if (lesson && id) {
    const draw = () => showLesson(lesson, id, words, progress)
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
  // A page that the browser has set aside hears of nothing.
  const again = new AbortController()
  addEventListener('pageshow', ({ persisted }) => persisted && progress.refresh(), { signal: again.signal })
  return () => {
    again.abort()
    ends.forEach((end) => end())
  }
}
