/**
 * What a reader has done of a course: its lessons and questions, as a page lists them, beside what is kept.
 *
 * Entry points: `readQuizzes`, `overview`, `totals`, `markOf`, `nextUp`. All of it is pure.
 */

import { answersByQuiz, matchQuestions } from './match.js'

/**
 * The questions that a page says a lesson has: `ID:KEY,KEY ID:…`, ids percent-encoded.
 * @param {string | undefined} text
 * @returns {{id: string, questions: {key: string, number: number}[]}[]}
 */
export function readQuizzes(text) {
  return (text ?? '').split(' ').filter(Boolean).map((part) => {
    const [id, questions = ''] = part.split(':')
    const keys = questions.split(',').filter(Boolean)
    return { id: decodeURIComponent(id), questions: keys.map((key, index) => ({ key, number: index + 1 })) }
  })
}

/**
 * @typedef {object} Done
 * @property {boolean} read
 * @property {boolean} begun
 * @property {number} questions
 * @property {number} answered
 * @property {number} right
 */

/**
 * What is done of each lesson, and what is kept of lessons and questions that are no more.
 * @param {{id: string, quizzes: ReturnType<typeof readQuizzes>}[]} lessons
 * @param {{quiz: string, key: string, kind: string, number: number, right: boolean | null}[]} answers
 * @param {Map<string, {read: boolean}>} kept lessons
 * @returns {{lessons: Map<string, Done>, answers: object[], orphans: {answers: object[], lessons: string[]}}} `answers`: those whose
 *   question is there, each with the `page` that has it and the `question` as it is now
 */
export function overview(lessons, answers, kept) {
  const byQuiz = answersByQuiz(answers)
  const done = new Map()
  const placed = []
  const orphans = { answers: [], lessons: [] }
  for (const { id, quizzes } of lessons) {
    const state = { read: kept.get(id)?.read ?? false, begun: kept.has(id), questions: 0, answered: 0, right: 0 }
    for (const { id: quiz, questions } of quizzes) {
      const matched = matchQuestions(byQuiz.get(quiz) ?? [], questions)
      byQuiz.delete(quiz)
      orphans.answers.push(...matched.orphans)
      state.questions += questions.length
      for (const question of questions) {
        const answer = matched.found.get(question.key)
        if (!answer) continue
        placed.push({ ...answer, page: id, question: question.key })
        state.answered += 1
        state.right += Number(answer.right === true)
      }
    }
    state.begun ||= state.answered > 0
    done.set(id, state)
  }
  for (const left of byQuiz.values()) orphans.answers.push(...left)
  for (const id of kept.keys()) if (!done.has(id)) orphans.lessons.push(id)
  return { lessons: done, answers: placed, orphans }
}

/** What is done of several lessons together. @param {Done[]} lessons */
export function totals(lessons) {
  const sum = { lessons: 0, read: 0, begun: 0, questions: 0, answered: 0, right: 0 }
  for (const { read, begun, questions, answered, right } of lessons) {
    sum.lessons += 1
    sum.read += Number(read)
    sum.begun += Number(begun && !read)
    sum.questions += questions
    sum.answered += answered
    sum.right += right
  }
  return sum
}

/** The mark of a lesson: `right` where all its questions are answered right, `read`, `begun`, or empty. @param {Done} done */
export function markOf({ read, begun, questions, right }) {
  if (questions > 0 && right === questions) return 'right'
  return read ? 'read' : begun ? 'begun' : ''
}

/**
 * Where to go on: in the lesson where the reader was last, or where that is read in the next that is not.
 * @param {string[]} order ids of the lessons that can be read
 * @param {{id: string, section: string, title: string} | null} last
 * @param {Map<string, {read: boolean}>} kept
 * @returns {{id: string, section: string, title: string} | 'all' | null} `all`: every lesson is read; `null`: none is begun
 */
export function nextUp(order, last, kept) {
  const isOpen = (id) => !kept.get(id)?.read
  if (last !== null && order.includes(last.id) && isOpen(last.id)) return last
  if (last === null && ![...kept.values()].some(({ read }) => read)) return null
  const from = order.indexOf(last?.id) + 1
  const id = [...order.slice(from), ...order.slice(0, from)].find(isOpen)
  return id === undefined ? (order.length > 0 ? 'all' : null) : { id, section: '', title: '' }
}
