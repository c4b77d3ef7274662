/**
 * Loads the script of quizzes, with the page: a quiz that came alive when a reader comes near would push what is below it away from
 * the pointer. `quiz.js` is a classic script, since browsers load no modules from disk; its functions are in the global
 * `coursebuildQuizzes`. Until it is loaded, and if it cannot be, the answers are behind folds.
 */

import { loadOnce } from './scripts.js'
import { selectAll } from './select.js'

/**
 * @param {Document | Element} part of the page
 * @param {(key: string) => string} words
 * @param {Record<string, any>} progress see progress/store.js
 */
export function mountQuizzes(part, words, progress) {
  if (selectAll(part, '.question[data-question]').length === 0) return
  const mount = () => globalThis.coursebuildQuizzes.mountQuizzes(part, words, progress)
  if (globalThis.coursebuildQuizzes) return mount()
  const address = document.getElementById('_words')?.dataset.quizScript
  if (address) loadOnce(new URL(address, document.baseURI).href).then(() => part.isConnected && mount(), () => {})
}

/** End the quizzes in a part that was removed from the page. */
export function leaveQuizzes(part) {
  globalThis.coursebuildQuizzes?.leaveQuizzes(part)
}
