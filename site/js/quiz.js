/** The script of quizzes, loaded when one comes near; see page/quizzes.js. */

import { leaveQuizzes, mountQuestion, mountQuizzes } from './quiz/mount.js'

globalThis.coursebuildQuizzes = { leaveQuizzes, mountQuestion, mountQuizzes }
