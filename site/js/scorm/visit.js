/**
 * A lesson in a platform: what happens on its pages, told to the session.
 *
 * Entry point: `Visit`. It knows nothing of frames: whoever shows the lesson tells it of answers, of reading, and of the end.
 *
 * 1. What the platform kept, and what this browser has kept of the same learner since, is known at the beginning.
 * 2. Another learner at the same machine gets nothing of it: the browser's progress is one learner's, and is emptied for the next.
 * 3. Each answer goes to the platform at once, with the points and the status that follow.
 */

import { grade, nameOf } from './answers.js'
import { packed, unpacked } from './suspend.js'

const LEARNER = 'coursebuild.learner.'

export class Visit {
  #session
  #lesson
  #answers = new Map()
  /** `null`: the page is not there yet. */
  #questions = null
  #read

  /**
   * @param {import('./session.js').Session} session
   * @param {{lesson: string, course: string}} place
   * @param {object} progress see progress/store.js
   * @param {Storage | null} storage
   */
  constructor(session, { lesson, course }, progress, storage) {
    this.#session = session
    this.#lesson = lesson
    if (isOther(session.learner, course, storage)) progress.reset()
    const { answers, read } = unpacked(session.kept)
    this.#read = read
    for (const answer of answers) this.#take(answer)
    for (const answer of progress.all()) {
      if (answer.lesson === lesson) this.#take(answer)
    }
    for (const { quiz, key, ...answer } of this.#answers.values()) {
      const there = progress.get(quiz, key)
      if (answer.given !== null && (!there || there.at < answer.at)) progress.put(quiz, key, { ...answer, lesson })
    }
    if (read) progress.markLesson(lesson, true)
  }

  /** The lesson's page is there, with these questions. */
  shows(questions) {
    this.#questions = questions
    this.#tell()
  }

  /** A question was answered. */
  answered(quiz, key, answer) {
    if (answer.lesson !== this.#lesson) return
    this.#answers.set(nameOf(quiz, key), { quiz, key, ...answer })
    const question = this.#questions?.find((one) => one.quiz === quiz && one.key === key)
    if (question) this.#session.answer(question, answer)
    this.#tell()
  }

  /** The lesson was read. */
  wasRead() {
    if (this.#read) return
    this.#read = true
    this.#tell()
  }

  /** The reader is in a section. */
  isAt(anchor) {
    this.location = anchor
  }

  /** The visit ends. */
  ends() {
    this.#tell()
    this.#session.finish()
  }

  #take(answer) {
    const name = nameOf(answer.quiz, answer.key)
    const known = this.#answers.get(name)
    if (!known || known.at < answer.at) this.#answers.set(name, answer)
  }

  #tell() {
    if (this.#questions === null) return
    const of = ({ quiz, key }) => this.#answers.get(nameOf(quiz, key)) ?? null
    const kept = packed([...this.#answers.values()], this.#read)
    this.#session.progress(grade(this.#questions, of, this.#read), kept, this.location ?? this.#session.location)
  }
}

/** Whether what this browser keeps is not this learner’s; from now on it is. */
function isOther(learner, course, storage) {
  const name = `${LEARNER}${course}`
  const mark = digest(learner)
  try {
    if (storage?.getItem(name) === mark) return false
    storage?.setItem(name, mark)
    return true // or nobody whom a platform named
  } catch {
    return true // nobody knows
  }
}

/** Tells learners apart without keeping their names: FNV-1a, 32 bits (G. Fowler, L. Noll, K. Vo). */
function digest(text) {
  let hash = 0x811c9dc5
  for (const byte of new TextEncoder().encode(text)) hash = Math.imul(hash ^ byte, 0x01000193) >>> 0
  return hash.toString(16)
}
