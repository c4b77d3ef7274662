/**
 * Answers as a learning platform records them.
 *
 * Entry points: `interaction`, the elements of `cmi.interactions.n` for an answer; `grade`, the points and the status of a lesson.
 *
 * @typedef {object} Question as its page shows it
 * @property {string} quiz
 * @property {string} key
 * @property {string} kind mcq, several, predict, numeric, output, order, open
 * @property {string[]} parts keys of the options as they are shown, or of the items, in an order that stays
 * @property {string | null} answer the right one: keys, a number or a text; `null` where nobody but a person can tell
 */

import { clock, decimal, identifier, shortText, signOf } from './formats.js'

const CHOSEN = ['mcq', 'several', 'predict']

/** By what an answer is told from those to other questions. */
export const nameOf = (quiz, key) => `${quiz}.${key}`

/**
 * What an answer is recorded as: pairs of an element's name and its value, in the order in which they are set.
 * @param {Question} question
 * @param {{given: unknown, right: boolean | null}} answer
 * @param {Date} now
 * @returns {[string, string][]}
 */
export function interaction(question, answer, now) {
  const { type, response, pattern } = told(question, plain(answer.given))
  // What a learner thinks of an own text is no verdict.
  const result = answer.right === null || question.answer === null ? 'neutral' : answer.right ? 'correct' : 'wrong'
  return [
    ['id', identifier(nameOf(question.quiz, question.key))],
    ['type', type],
    ['time', clock(now)],
    ...(pattern ? [['correct_responses.0.pattern', pattern]] : []),
    ...(response ? [['student_response', response]] : []),
    ['weighting', '1'],
    ['result', result],
  ]
}

/** What was entered, as a text or several: an open question has a text and the learner's own mark of it. */
function plain(given) {
  if (Array.isArray(given)) return given.map(String)
  return String((typeof given === 'object' ? given?.text : given) ?? '')
}

function told(question, given) {
  const right = question.answer ?? ''
  if (CHOSEN.includes(question.kind) || question.kind === 'order') {
    const keys = Array.isArray(given) ? given : given.split(' ').filter(Boolean)
    const [response, pattern] = [signs(question, keys), signs(question, right.split(' '))]
    const type = question.kind === 'order' ? 'sequencing' : 'choice'
    // More options than there are signs, or one that is no longer there: its own words say it better than a wrong sign.
    if (response !== null && pattern !== null) return { type, response, pattern }
    return { type: 'fill-in', response: shortText(keys.join(' ')), pattern: '' }
  }
  const text = Array.isArray(given) ? given.join(' ') : given
  if (question.kind === 'numeric' && decimal(text) !== null) {
    return { type: 'numeric', response: decimal(text), pattern: decimal(right) ?? '' }
  }
  return { type: 'fill-in', response: shortText(text), pattern: question.kind === 'open' ? '' : shortText(right) }
}

/** The signs of some keys with commas between them, those of a choice in the order of the options; `null` where one has none. */
function signs(question, keys) {
  const found = keys.map((key) => signOf(question.parts.indexOf(key)))
  if (found.includes(null)) return null
  return (question.kind === 'order' ? found : found.sort()).join(',')
}

/**
 * The points of a lesson, of 100, and its status.
 *
 * Passed: every question that can be checked is right. Completed: each of them is answered; where there is none, the lesson was read.
 * @param {Question[]} questions
 * @param {(question: Question) => {right: boolean | null} | null} answerTo
 * @param {boolean} read
 * @returns {{raw: number | null, status: 'incomplete' | 'completed' | 'passed'}} no points where nothing can be checked
 */
export function grade(questions, answerTo, read) {
  const checked = questions.filter(({ answer }) => answer !== null)
  if (checked.length === 0) return { raw: null, status: read ? 'completed' : 'incomplete' }
  const verdicts = checked.map((question) => answerTo(question)?.right ?? null)
  const right = verdicts.filter((verdict) => verdict === true).length
  const raw = Math.floor((10_000 * right) / checked.length) / 100
  if (right === checked.length) return { raw, status: 'passed' }
  return { raw, status: verdicts.includes(null) ? 'incomplete' : 'completed' }
}
