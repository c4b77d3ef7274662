/** Follows the lesson's pages in the frame: their questions, answers, and how far they are read. */

/**
 * Follow the pages in a frame.
 * @param {HTMLIFrameElement} frame
 * @param {string} lesson its id
 * @param {{shows: Function, answered: Function, wasRead: Function, isAt: Function}} visit
 * @param {() => void} onChange called after each change
 */
export function followFrame(frame, lesson, visit, onChange) {
  const begin = () => {
    const { document } = frame.contentWindow
    document.addEventListener('coursebuild:answered', ({ detail: { quiz, key, answer } }) => {
      visit.answered(quiz, key, answer)
      onChange()
    })
    if (document.querySelector('main')?.dataset.lesson !== lesson) return
    visit.shows(questionsOf(document))
    document.addEventListener('coursebuild:reading', ({ detail: { section, isRead } }) => {
      visit.isAt(section)
      if (!isRead) return
      visit.wasRead()
      onChange()
    })
    onChange()
  }
  frame.addEventListener('load', begin)
}

/** The questions and exercises of a page, as `answers.js` knows them. */
export function questionsOf(document) {
  const exercises = [...document.querySelectorAll('[data-exercise]')].map((element) => {
    const { id } = JSON.parse(element.dataset.exercise)
    return { quiz: id, key: id, kind: 'exercise', parts: [], answer: 'solved' }
  })
  const questions = [...document.querySelectorAll('.question[data-question]')].map((element) => {
    const { question: key, kind, answer } = element.dataset
    const quiz = element.closest('[data-quiz]')?.dataset.quiz ?? ''
    const parts = [...element.querySelectorAll('[data-key]')].map(({ dataset }) => dataset.key)
    // Items stand in the learner's order, on which their signs must not depend.
    if (kind === 'order') parts.sort()
    return { quiz, key, kind, parts, answer: kind === 'open' ? null : answer ?? null }
  })
  return [...questions, ...exercises]
}
