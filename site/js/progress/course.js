/**
 * What a reader has done of a course: matches the lessons and questions that a page lists with the stored progress.
 *
 * Entry points: `readQuizzes`, `overview`, `totals`, `markOf`, `nextUp`. All of it is pure.
 */

import { matchQuestions } from './match.js'

/**
 * Parse the list of a lesson's questions in a page: `ID:KEY,KEY ID:…`, ids percent-encoded.
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

/** @typedef {{read: boolean, begun: boolean, questions: number, answered: number, right: number}} Done of a lesson */

/**
 * The state of each lesson, and the stored progress of lessons and questions that no longer exist.
 * @param {{id: string, quizzes: ReturnType<typeof readQuizzes>}[]} lessons
 * @param {{quiz: string, key: string, kind: string, number: number, right: boolean | null}[]} answers
 * @param {Map<string, {read: boolean}>} storedLessons
 * @returns {{lessons: Map<string, Done>, answers: any[], orphans: {answers: any[], lessons: string[]}}} `answers`: those whose
 *   question exists, each with the `page` that has it and the present key of the `question`
 */
export function overview(lessons, answers, storedLessons) {
  const byQuiz = Map.groupBy(answers, ({ quiz }) => quiz)
  const states = new Map()
  const matchedAnswers = []
  const orphans = { answers: [], lessons: [] }
  for (const { id, quizzes } of lessons) {
    const state = { read: storedLessons.get(id)?.read ?? false, begun: storedLessons.has(id), questions: 0, answered: 0, right: 0 }
    for (const { id: quiz, questions } of quizzes) {
      const { matched, orphans: rest } = matchQuestions(byQuiz.get(quiz) ?? [], questions)
      byQuiz.delete(quiz)
      orphans.answers.push(...rest)
      state.questions += questions.length
      for (const question of questions) {
        const answer = matched.get(question.key)
        if (!answer) continue
        matchedAnswers.push({ ...answer, page: id, question: question.key })
        state.answered += 1
        state.right += Number(answer.right === true)
      }
    }
    state.begun ||= state.answered > 0
    states.set(id, state)
  }
  for (const unmatched of byQuiz.values()) orphans.answers.push(...unmatched)
  for (const id of storedLessons.keys()) if (!states.has(id)) orphans.lessons.push(id)
  return { lessons: states, answers: matchedAnswers, orphans }
}

/** The sums over several lessons. @param {Done[]} lessons */
export function totals(lessons) {
  const sum = (numberOf) => lessons.reduce((total, lesson) => total + Number(numberOf(lesson)), 0)
  const [questions, answered, right] = ['questions', 'answered', 'right'].map((name) => sum((lesson) => lesson[name]))
  return { lessons: lessons.length, read: sum(({ read }) => read), begun: sum(({ begun, read }) => begun && !read), questions, answered, right }
}

/** The mark of a lesson: `right` if all its questions are answered right, `read`, `begun`, or empty. @param {Done} done */
export function markOf({ read, begun, questions, right }) {
  if (questions > 0 && right === questions) return 'right'
  return read ? 'read' : begun ? 'begun' : ''
}

/**
 * Where to go on: in the lesson where the reader was last or, if that is read, in the next that is not.
 * @param {string[]} order ids of the lessons that can be read
 * @param {{id: string, section: string, title: string} | null} last
 * @param {Map<string, {read: boolean}>} storedLessons
 * @returns {{id: string, section: string, title: string} | 'all' | null} `all`: every lesson is read; `null`: no lesson is begun
 */
export function nextUp(order, last, storedLessons) {
  const isOpen = (id) => !storedLessons.get(id)?.read
  if (last !== null && order.includes(last.id) && isOpen(last.id)) return last
  if (last === null && ![...storedLessons.values()].some(({ read }) => read)) return null
  const start = order.indexOf(last?.id) + 1
  const id = [...order.slice(start), ...order.slice(0, start)].find(isOpen)
  return id === undefined ? (order.length > 0 ? 'all' : null) : { id, section: '', title: '' }
}
