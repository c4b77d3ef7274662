/**
 * The reader's progress in the pages: marks on maps, the end of lessons, and the pages that are about it.
 *
 * Entry point: `showProgress(document, words, progress, improve)`. Everything that it shows is drawn again after each change, also one
 * that was made in another tab.
 */

import { followLesson, showLesson } from './lesson.js'
import { showMap } from './map.js'

/** What brings the pages about the reader to life, once their own script has come; see reader-page.js. */
let reader = null

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
  const begin = () => ends.push(reader(document, { words, progress, improve }))
  if (document.querySelector(':is([data-progress="overall"], [data-progress="review"])')) {
    if (reader) begin()
    else {
      const start = ({ detail }) => {
        reader = detail
        begin()
      }
      document.addEventListener('coursebuild:reader', start, { once: true })
      ends.push(() => document.removeEventListener('coursebuild:reader', start))
    }
  } else if (lesson && id) {
    const draw = () => showLesson(lesson, id, words, progress)
    draw()
    ends.push(progress.onChange(draw), followLesson(document, id, progress))
  } else if (document.querySelector('[data-mark]')) {
    const draw = () => showMap(document, words, progress)
    draw()
    ends.push(progress.onChange(draw))
  } else return () => {}
  // A page that the browser has set aside hears of nothing.
  const again = new AbortController()
  addEventListener('pageshow', ({ persisted }) => persisted && progress.refresh(), { signal: again.signal })
  return () => {
    again.abort()
    ends.forEach((end) => end())
  }
}
