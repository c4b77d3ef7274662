/**
 * The script of quizzes, loaded with a page that holds some (see page/quizzes.js), and with the page of the review: each question of a
 * part of the page gets its form, and shows its stored answer.
 *
 *   mountQuizzes(part, words, progress)    called for new parts of the page
 *   leaveQuizzes(part)                     called for removed parts
 *
 * Answers to questions whose text has changed were moved to their new keys before (progress/match.js). After every change of an answer
 * the event `coursebuild:answered` bubbles from the question; its detail is `{ quiz, key, answer }`.
 */

import { selectAll } from './page/select.js'
import { canBeLive, Question } from './quiz/question.js'

const disposers = new WeakMap() // element → function that ends it
const drafts = new Map() // unchecked entries in questions that were replaced

/**
 * @param {Document | Element} part
 * @param {(key: string) => string} words
 * @param {Record<string, any> | null} progress see progress/store.js; null: nothing is stored
 * @param {{fresh?: boolean}} options `fresh`: do not show stored answers, as in a review
 */
function mountQuizzes(part, words, progress = null, options = {}) {
  for (const element of selectAll(part, '.question[data-question]')) mountQuestion(element, words, progress, options)
}

/** Mount a question. @returns {Question | null} null if it cannot be answered in the page */
function mountQuestion(element, words, progress = null, { fresh = false } = {}) {
  if (!canBeLive(element)) return null
  const place = placeOf(element)
  const record = (answer) => {
    const full = { kind: place.kind, ...answer, number: place.number, lesson: place.lesson }
    progress?.put(place.quiz, place.key, full)
    const detail = { quiz: place.quiz, key: place.key, answer: full }
    element.dispatchEvent(new CustomEvent('coursebuild:answered', { bubbles: true, detail }))
  }
  const question = new Question(element, words, record)
  const storedAnswer = fresh ? null : progress?.get(place.quiz, place.key)
  if (storedAnswer) question.restore(storedAnswer)
  const name = `${place.quiz}/${place.key}`
  if (!fresh && drafts.has(name)) question.showDraft(drafts.get(name))
  drafts.delete(name)
  const unsubscribe = fresh || !progress?.onChange ? () => {} : progress.onChange(({ isLocal } = /** @type {{isLocal?: boolean}} */ ({})) => isLocal || follow(question, place, progress))
  disposers.set(element, () => {
    unsubscribe()
    const draft = question.draft()
    if (!fresh && draft !== null) drafts.set(name, draft)
  })
  return question
}

/** End the questions in a part that was removed from the page. */
function leaveQuizzes(part) {
  for (const element of selectAll(part, '.question[data-question]')) {
    disposers.get(element)?.()
    disposers.delete(element)
  }
}

function placeOf(element) {
  const { question: key, kind, number } = element.dataset
  const quiz = element.closest('[data-quiz]')?.dataset.quiz ?? ''
  return { quiz, key, kind, number: Number(number), lesson: element.closest('[data-lesson]')?.dataset.lesson ?? '' }
}

/** Follow a change in another tab, unless the reader is editing the answer here. */
function follow(question, { quiz, key }, progress) {
  if (question.dirty) return
  const storedAnswer = progress.get(quiz, key)
  if (storedAnswer?.at === question.savedAt) return
  if (storedAnswer) question.restore(storedAnswer)
  else if (question.result) question.empty()
}

globalThis.coursebuildQuizzes = { leaveQuizzes, mountQuestion, mountQuizzes }
