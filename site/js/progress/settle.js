/** Answers to questions whose text has changed since: their new keys are taken over where the page shows them. */

import { answersByQuiz, matchQuestions } from './match.js'

/** Let the answers of the quizzes of a page go by the keys that their questions have now. Before quizzes come alive. */
export function settleAnswers(document, progress) {
  const quizzes = [...document.querySelectorAll('[data-quiz]')]
  if (quizzes.length === 0) return
  const byQuiz = answersByQuiz(progress.all())
  for (const section of quizzes) {
    const { quiz } = section.dataset
    const present = [...section.querySelectorAll('[data-question]')].map(({ dataset: { question, kind, number } }) => ({
      key: question,
      kind,
      number: Number(number),
    }))
    const { found } = matchQuestions(byQuiz.get(quiz) ?? [], present)
    for (const [key, answer] of found) if (answer.key !== key) progress.rename(quiz, answer.key, key)
  }
}
