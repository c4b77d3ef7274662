/**
 * A visit to a lesson in a platform: passes what happens on its pages on to the session.
 *
 * Entry point: `Visit`. It does not depend on frames: its methods are called for answers, for reading, and at the end.
 *
 * 1. At the beginning it merges the platform's data and this browser's newer progress of the same learner.
 * 2. Another learner at the same machine sees none of it: the browser's progress is emptied for the next learner.
 * 3. Each answer goes to the platform at once, with the new points and status.
 */

import { readChoice, writeChoice } from '../page/choices.js'
import { hashOf } from '../page/hash.js'
import { grade, nameOf } from './answers.js'
import { pack, unpack } from './suspend.js'

const LEARNER = 'coursebuild.learner.'

export class Visit {
  #session
  #lesson
  #answers = new Map()
  /** `null` until the page is loaded. */
  #questions = null
  #read

  /**
   * @param {ReturnType<typeof import('./session.js').beginSession>} session
   * @param {{lesson: string, course: string}} place
   * @param {Record<string, any>} progress see progress/store.js
   * @param {Storage | null} storage
   */
  constructor(session, { lesson, course }, progress, storage) {
    this.#session = session
    this.#lesson = lesson
    if (changesLearner(session.learner, course, storage)) progress.reset()
    const { answers, read } = unpack(session.suspendData)
    this.#read = read
    for (const answer of answers) this.#keepNewest(answer)
    for (const answer of progress.all()) {
      if (answer.lesson === lesson) this.#keepNewest(answer)
    }
    for (const { quiz, key, ...answer } of this.#answers.values()) {
      const storedAnswer = progress.get(quiz, key)
      if (answer.given !== null && (!storedAnswer || storedAnswer.at < answer.at)) progress.put(quiz, key, { ...answer, lesson })
    }
    if (read) progress.markLesson(lesson, true)
  }

  /** The lesson's page is loaded, with these questions. */
  shows(questions) {
    this.#questions = questions
    this.#report()
  }

  answered(quiz, key, answer) {
    if (answer.lesson !== this.#lesson) return
    this.#answers.set(nameOf(quiz, key), { quiz, key, ...answer })
    const question = this.#questions?.find((candidate) => candidate.quiz === quiz && candidate.key === key)
    if (question) this.#session.answer(question, answer)
    this.#report()
  }

  wasRead() {
    if (this.#read) return
    this.#read = true
    this.#report()
  }

  /** The reader is in a section. */
  isAt(anchor) {
    this.location = anchor
  }

  ends() {
    this.#report()
    this.#session.finish()
  }

  #keepNewest(answer) {
    const name = nameOf(answer.quiz, answer.key)
    const older = this.#answers.get(name)
    if (!older || older.at < answer.at) this.#answers.set(name, answer)
  }

  #report() {
    if (this.#questions === null) return
    const answerTo = ({ quiz, key }) => this.#answers.get(nameOf(quiz, key)) ?? null
    const data = pack([...this.#answers.values()], this.#read)
    this.#session.progress(grade(this.#questions, answerTo, this.#read), data, this.location ?? this.#session.location)
  }
}

/** Whether this browser's progress belongs to another learner; from now on it belongs to this one. */
function changesLearner(learner, course, storage) {
  const name = `${LEARNER}${course}`
  const mark = hashOf(learner).toString(16) // a name is not stored
  if (readChoice(name, storage) === mark) return false
  writeChoice(name, mark, storage)
  return true // also if it belongs to nobody that a platform has named, or that is unknown
}
