/**
 * Answers in the form in which a learning platform records them.
 *
 * Entry points: `interaction` returns the elements of `cmi.interactions.n` for an answer; `grade` the points and status of a lesson.
 *
 * @typedef {Record<string, any>} Question as its page shows it
 * @property {string} quiz
 * @property {string} key
 * @property {string} kind mcq, several, predict, numeric, output, order, open, exercise
 * @property {string[]} parts keys of the options in their order on the page, or of the items in a fixed order
 * @property {string | null} answer the right one: keys, a number or a text; `null` if only a person can judge
 */

import { clock, decimal, identifier, shortText, signOf } from './formats.js'

const CHOSEN = ['mcq', 'several', 'predict']

/** The name of a question, unique in the course. */
export const nameOf = (quiz, key) => `${quiz}.${key}`

/**
 * The record of an answer: pairs of an element's name and its value, in the order in which they must be set.
 * @param {Question} question
 * @param {{given: unknown, right: boolean | null}} answer
 * @param {Date} now
 * @returns {string[][]}
 */
export function interaction(question, answer, now) {
  const { type, response, pattern } = describe(question, textOf(answer.given))
  // A learner's judgement of their own text is no verdict.
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

/** What was entered, as a text or a list of texts: the answer to an open question is an object with a text and the learner's own mark. */
function textOf(entered) {
  if (Array.isArray(entered)) return entered.map(String)
  return String((typeof entered === 'object' ? entered?.text : entered) ?? '')
}

function describe(question, entered) {
  const correct = question.answer ?? ''
  if (CHOSEN.includes(question.kind) || question.kind === 'order') {
    const keys = Array.isArray(entered) ? entered : entered.split(' ').filter(Boolean)
    const [response, pattern] = [lettersOf(question, keys), lettersOf(question, correct.split(' '))]
    const type = question.kind === 'order' ? 'sequencing' : 'choice'
    // More options than signs, or one that no longer exists: the keys themselves are better than a wrong sign.
    if (response !== null && pattern !== null) return { type, response, pattern }
    return { type: 'fill-in', response: shortText(keys.join(' ')), pattern: '' }
  }
  const text = Array.isArray(entered) ? entered.join(' ') : entered
  if (question.kind === 'numeric' && decimal(text) !== null) {
    return { type: 'numeric', response: decimal(text), pattern: decimal(correct) ?? '' }
  }
  return { type: 'fill-in', response: shortText(text), pattern: question.kind === 'open' ? '' : shortText(correct) }
}

/** The signs of these keys, joined by commas, for a choice in the order of the options; `null` if one has none. */
function lettersOf(question, keys) {
  const letters = keys.map((key) => signOf(question.parts.indexOf(key)))
  if (letters.includes(null)) return null
  return (question.kind === 'order' ? letters : letters.sort()).join(',')
}

/**
 * The points of a lesson, out of 100, and its status.
 *
 * Passed: every question that can be checked is right. Completed: each of them is answered or, if there is none, the lesson was read.
 * @param {Question[]} questions
 * @param {(question: Question) => {right: boolean | null} | null} answerTo
 * @param {boolean} read
 * @returns {{raw: number | null, status: 'incomplete' | 'completed' | 'passed'}} no points if nothing can be checked
 */
export function grade(questions, answerTo, read) {
  const gradable = questions.filter(({ answer }) => answer !== null)
  if (gradable.length === 0) return { raw: null, status: read ? 'completed' : 'incomplete' }
  const verdicts = gradable.map((question) => answerTo(question)?.right ?? null)
  const correctCount = verdicts.filter((verdict) => verdict === true).length
  const raw = Math.floor((10_000 * correctCount) / gradable.length) / 100
  if (correctCount === gradable.length) return { raw, status: 'passed' }
  return { raw, status: verdicts.includes(null) ? 'incomplete' : 'completed' }
}
