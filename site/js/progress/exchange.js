/**
 * Progress from a file: taken whole or not at all.
 *
 * Entry point: `importText(progress, text)`. A part of its own, since only the page of the reader's progress brings in files.
 */

import { decode, merge, StateError, VERSION } from './state.js'

const SIZE = 32 * 2 ** 20

/** A file that is no progress, or none of this course. `code`: size, json, kind, version, course, entry, full. */
export class ImportError extends Error {
  constructor(code, detail = '') {
    super(detail ? `${code}: ${detail}` : code)
    this.code = code
    this.detail = detail
  }
}

/** The state that a file holds. @throws {ImportError} */
function readFile(text, course) {
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

/**
 * Merge what `exportText` gave, here or on another device. Nothing is changed where it throws.
 * @param {ReturnType<import('./store.js').openProgress>} progress
 * @param {{restore?: boolean}} options `restore`: bring back what was there before a reset
 * @returns {{answers: number, lessons: number, restorable: number}} so many answers and lessons are new or other than before; so many
 *   in the file are not there since they were reset or removed
 * @throws {ImportError}
 */
export function importText(progress, text, { restore = false } = {}) {
  const file = readFile(text, progress.course)
  let told = null
  const done = progress.replace((state, tick) => {
    const merged = merge(state, file)
    const made = restore ? restored(merged, file, tick) : merged
    told = { ...changes(made, state), restorable: missing(made, file) }
    return made
  })
  if (!done) throw new ImportError('full')
  return told
}

/** A state in which what a file has and the state has not, since it was reset or removed, is new; `tick` gives its ticks. */
function restored(state, file, tick) {
  const renew = (have, old) => {
    const entry = { gone: have?.gone ?? 0, values: new Map(have?.values), recalls: have?.recalls ?? [] }
    for (const [name, value] of old.values) {
      if (!entry.values.has(name)) entry.values.set(name, { ...value, tick: tick() })
    }
    if (!have?.values.size) entry.recalls = old.recalls.map((recall) => ({ ...recall, tick: tick() }))
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
function missing(state, file) {
  let count = 0
  for (const [quiz, entries] of file.answers) {
    for (const [key, entry] of entries) count += isMissing(state.answers.get(quiz)?.get(key), entry)
  }
  for (const [id, entry] of file.lessons) count += isMissing(state.lessons.get(id), entry)
  return count
}

/** So many answers and lessons of a state are new, or other than before. */
function changes(state, before) {
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
  return Number([...entry.values].some(([name, { tick }]) => before?.values.get(name)?.tick !== tick))
}
