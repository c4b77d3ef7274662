/** Finding kept answers again in a quiz whose questions have changed. */

/**
 * Find answers again whose question has another key than when they were given: by its number, where the kind is the same or unknown.
 * @template {{key: string, kind: string, number: number}} K
 * @param {K[]} kept answers of a quiz
 * @param {{key: string, kind?: string, number: number}[]} present questions that it has now
 * @returns {{found: Map<string, K>, orphans: K[]}} answers by the key that their question has now, and those without a question
 */
export function matchQuestions(kept, present) {
  const found = new Map()
  const keys = new Set(present.map(({ key }) => key))
  const homeless = kept.filter((answer) => {
    if (keys.has(answer.key)) found.set(answer.key, answer)
    return !keys.has(answer.key)
  })
  const orphans = homeless.filter((answer) => {
    const fits = ({ key, kind, number }) => !found.has(key) && (kind ?? answer.kind) === answer.kind && number === answer.number
    const question = present.find(fits)
    if (question) found.set(question.key, answer)
    return !question
  })
  return { found, orphans }
}

/** Answers by the id of their quiz. @template {{quiz: string}} K @param {K[]} answers @returns {Map<string, K[]>} */
export function answersByQuiz(answers) {
  const found = new Map()
  for (const answer of answers) {
    const same = found.get(answer.quiz)
    if (same) same.push(answer)
    else found.set(answer.quiz, [answer])
  }
  return found
}
