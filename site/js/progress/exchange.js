/**
 * Texts of progress from elsewhere: files that a reader brings, and what the browser's storage holds.
 *
 * Entry points: `readFile`, which takes a file whole or not at all; `understood`, which takes of a kept text what it can; `restored`,
 * `changes` and `missing`, what bringing in a file means.
 */

import { decode, StateError, VERSION } from './state.js'

const SIZE = 32 * 2 ** 20

/** A file that is no progress, or none of this course. `code`: size, json, kind, version, course, entry, full. */
export class ImportError extends Error {
  constructor(code, detail = '') {
    super(detail ? `${code}: ${detail}` : code)
    this.name = 'ImportError' // by which another script knows it, which has a class of its own
    this.code = code
    this.detail = detail
  }
}

/** The state that a file holds. @throws {ImportError} */
export function readFile(text, course) {
  if (text.length > SIZE) throw new ImportError('size')
  let data
  try {
    data = JSON.parse(text)
  } catch (error) {
    throw new ImportError('json', error.message)
  }
  if (data?.coursebuild !== 'progress') throw new ImportError('kind')
  if (data.version !== VERSION) throw new ImportError(data.version > VERSION ? 'version' : 'kind')
  if (data.course !== course) throw new ImportError('course', String(data.course).slice(0, 200))
  try {
    return decode(data, (error) => {
      throw error
    })
  } catch (error) {
    if (error instanceof StateError) throw new ImportError('entry', error.where.slice(0, 200))
    throw error
  }
}

/** What a text says, as far as it can be read. */
export function understood(text, course) {
  let whole = true
  try {
    const data = JSON.parse(text)
    if (data?.coursebuild === 'progress' && data.version > VERSION) return { state: null, trouble: 'newer' }
    if (data?.coursebuild !== 'progress' || data.version !== VERSION || data.course !== course) return { state: null, trouble: 'damaged' }
    const state = decode(data, () => {
      whole = false
    })
    return { state, trouble: whole ? null : 'damaged' }
  } catch {
    return { state: null, trouble: 'damaged' }
  }
}

/** A state in which what a file has and the state has not, since it was reset or removed, is new; `tick` gives its stamps. */
export function restored(state, file, tick) {
  const renew = (have, old) => {
    const entry = { gone: have?.gone ?? 0, values: new Map(have?.values), trials: have?.trials ?? [] }
    for (const [name, value] of old.values) {
      if (!entry.values.has(name)) entry.values.set(name, { ...value, stamp: tick() })
    }
    if (!have?.values.size) entry.trials = old.trials.map((trial) => ({ ...trial, stamp: tick() }))
    return entry
  }
  const answers = new Map(state.answers)
  for (const [quiz, entries] of file.answers) {
    const made = new Map(answers.get(quiz))
    for (const [key, entry] of entries) if (isMissing(made.get(key), entry)) made.set(key, renew(made.get(key), entry))
    answers.set(quiz, made)
  }
  const lessons = new Map(state.lessons)
  for (const [id, entry] of file.lessons) if (isMissing(lessons.get(id), entry)) lessons.set(id, renew(lessons.get(id), entry))
  return { ...state, answers, lessons }
}

/** Whether an entry of a file has something of which a state has nothing. */
const isMissing = (have, entry) => [...entry.values.keys()].some((name) => !have?.values.has(name))

/** So many answers and lessons of a file are not in a state. */
export function missing(state, file) {
  let count = 0
  for (const [quiz, entries] of file.answers) {
    for (const [key, entry] of entries) count += isMissing(state.answers.get(quiz)?.get(key), entry)
  }
  for (const [id, entry] of file.lessons) count += isMissing(state.lessons.get(id), entry)
  return count
}

/** So many answers and lessons of a state are new, or other than before. */
export function changes(state, before) {
  const found = { answers: 0, lessons: 0 }
  for (const [quiz, entries] of state.answers) {
    for (const [key, entry] of entries) found.answers += differs(entry, before.answers.get(quiz)?.get(key))
  }
  for (const [id, entry] of state.lessons) found.lessons += differs(entry, before.lessons.get(id))
  return found
}

/** 1 where an entry says something else than before, else 0. */
function differs(entry, before) {
  if (entry === before || entry.values.size === 0) return 0
  return Number([...entry.values].some(([name, { stamp }]) => before?.values.get(name)?.stamp !== stamp))
}
