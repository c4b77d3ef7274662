/**
 * Quizzes, for the pages that have some: a plain script, since browsers load no modules from a disk. It stands before site.js, which
 * calls what it offers as `coursebuildQuizzes`.
 */

import { leaveQuizzes, mountQuestion, mountQuizzes } from './quiz/mount.js'

globalThis.coursebuildQuizzes = { leaveQuizzes, mountQuestion, mountQuizzes }
