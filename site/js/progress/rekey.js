/** Moves answers to the new keys of questions whose text has changed. */

import { answersByQuiz, matchQuestions } from './match.js'

/** Move the answers of the page's quizzes to the present keys of their questions; called before quizzes are mounted. */
export function rekeyAnswers(document, progress) {
  const quizzes = [...document.querySelectorAll('[data-quiz]')]
  if (quizzes.length === 0) return
  /** @type {Map<string, any[]>} */
  const byQuiz = answersByQuiz(progress.all())
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
