/**
 * Quizzes come alive: each question of a part of the page gets its form, and shows what was answered before.
 *
 *   mountQuizzes(part, words, progress)    called for what is new in the page
 *   leaveQuizzes(part)                     for what has gone from it
 *
 * Answers of questions whose text has changed have found their new keys before (progress/rekey.js). After every change of an answer
 * the event `coursebuild:answered` bubbles from the question; its detail is `{ quiz, key, answer }`.
 */

import { selectAll } from '../page/select.js'
import { canBeLive, Question } from './question.js'

const live = new WeakMap() // element → what ends it
const drafts = new Map() // what was entered and not checked in questions that were replaced

/**
 * @param {Document | Element} part
 * @param {(key: string) => string} words
 * @param {object | null} progress see progress/store.js; null: nothing is kept
 * @param {{fresh?: boolean}} options `fresh`: answers of before are not shown, as in a review
 */
export function mountQuizzes(part, words, progress = null, options = {}) {
  for (const element of selectAll(part, '.question[data-question]')) mountQuestion(element, words, progress, options)
}

/** One question. @returns {Question | null} null where it cannot be answered in the page */
export function mountQuestion(element, words, progress = null, { fresh = false } = {}) {
  if (!canBeLive(element)) return null
  const place = placeOf(element)
  const keep = (answer) => {
    const whole = { kind: place.kind, ...answer, number: place.number, lesson: place.lesson }
    progress?.put(place.quiz, place.key, whole)
    const detail = { quiz: place.quiz, key: place.key, answer: whole }
    element.dispatchEvent(new CustomEvent('coursebuild:answered', { bubbles: true, detail }))
  }
  const question = new Question(element, words, keep)
  const kept = fresh ? null : progress?.get(place.quiz, place.key)
  if (kept) question.restore(kept)
  const name = `${place.quiz}/${place.key}`
  if (!fresh && drafts.has(name)) question.showDraft(drafts.get(name))
  drafts.delete(name)
  const deaf = fresh || !progress?.onChange ? () => {} : progress.onChange(({ isLocal } = {}) => isLocal || follow(question, place, progress))
  live.set(element, () => {
    deaf()
    const draft = question.draft()
    if (!fresh && draft !== null) drafts.set(name, draft)
  })
  return question
}

/** End what was begun for questions that have gone from the page. */
export function leaveQuizzes(part) {
  for (const element of selectAll(part, '.question[data-question]')) {
    live.get(element)?.()
    live.delete(element)
  }
}

function placeOf(element) {
  const { question: key, kind, number } = element.dataset
  const quiz = element.closest('[data-quiz]')?.dataset.quiz ?? ''
  return { quiz, key, kind, number: Number(number), lesson: element.closest('[data-lesson]')?.dataset.lesson ?? '' }
}

/** Another tab has changed something: what nobody touches here follows. */
function follow(question, { quiz, key }, progress) {
  if (question.dirty) return
  const kept = progress.get(quiz, key)
  if (kept?.at === question.at) return
  if (kept) question.restore(kept)
  else if (question.result) question.empty()
}
