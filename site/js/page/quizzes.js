/** Quizzes in the page: only pages that have some load their script, `quiz.js`. */

export const mountQuizzes = (part, words, progress, options) => globalThis.coursebuildQuizzes?.mountQuizzes(part, words, progress, options)

export const leaveQuizzes = (part) => globalThis.coursebuildQuizzes?.leaveQuizzes(part)
