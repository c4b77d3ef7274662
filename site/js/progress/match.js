/** Matches stored answers with the questions of a quiz that has changed. */

/**
 * Match answers with questions by key; an answer whose key no longer exists by number, if the kind is the same or unknown.
 * @template {{key: string, kind: string, number: number}} K
 * @param {K[]} answers of a quiz
 * @param {{key: string, kind?: string, number: number}[]} present its questions
 * @returns {{matched: Map<string, K>, orphans: K[]}} answers by the present key of their question, and those without a question
 */
export function matchQuestions(answers, present) {
  const matched = new Map()
  const keys = new Set(present.map(({ key }) => key))
  const unmatched = answers.filter((answer) => {
    if (keys.has(answer.key)) matched.set(answer.key, answer)
    return !keys.has(answer.key)
  })
  const orphans = unmatched.filter((answer) => {
    const fits = ({ key, kind, number }) => !matched.has(key) && (kind ?? answer.kind) === answer.kind && number === answer.number
    const question = present.find(fits)
    if (question) matched.set(question.key, answer)
    return !question
  })
  return { matched, orphans }
}

/** Move the answers of the page's quizzes to the present keys of their questions; called before quizzes are mounted. */
export function rekeyAnswers(document, progress) {
  const quizzes = [...document.querySelectorAll('[data-quiz]')]
  if (quizzes.length === 0) return
  const byQuiz = Map.groupBy(progress.all(), (/** @type {any} */ { quiz }) => quiz)
  for (const section of quizzes) {
    const { quiz } = section.dataset
    const present = [...section.querySelectorAll('[data-question]')].map(({ dataset: { question, kind, number } }) => ({
      key: question,
      kind,
      number: Number(number),
    }))
    const { matched } = matchQuestions(byQuiz.get(quiz) ?? [], present)
    for (const [key, answer] of matched) if (answer.key !== key) progress.rename(quiz, answer.key, key)
  }
}
