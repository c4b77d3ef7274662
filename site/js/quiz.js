/** The script of quizzes, loaded when one comes near (see page/quizzes.js), and with the page of the review. */

import { leaveQuizzes, mountQuestion, mountQuizzes } from './quiz/mount.js'

globalThis.coursebuildQuizzes = { leaveQuizzes, mountQuestion, mountQuizzes }
