/** The script of quizzes, loaded with a page that holds some (see page/quizzes.js), and with the page of the review. */

import { leaveQuizzes, mountQuestion, mountQuizzes } from './quiz/mount.js'

globalThis.coursebuildQuizzes = { leaveQuizzes, mountQuestion, mountQuizzes }
