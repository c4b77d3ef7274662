/**
 * Imports progress from a file, all of it or nothing.
 *
 * Entry point: `importText(progress, text)`. A module of its own, since only the page of the reader's progress imports files.
 */

import { decode, merge, NOTHING, StateError, wrongHead } from './state.js'

const SIZE = 32 * 2 ** 20

/** The file holds no progress, or that of another course. `code`: size, json, kind, version, course, entry, full. */
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
  const wrong = wrongHead(data, course)
  if (wrong !== '') throw new ImportError(wrong, wrong === 'course' ? String(data.course).slice(0, 200) : '')
  try {
    return decode(data, (error) => {
      throw error
    })
  } catch (error) {
    if (error instanceof StateError) throw new ImportError('entry', error.path.slice(0, 200))
    throw error
  }
}

/**
 * Merge the text of an `exportText` on this or another device. Nothing is changed if it throws.
 * @param {ReturnType<typeof import('./store.js').openProgress>} progress
 * @param {string} text
 * @param {{restore?: boolean}} options `restore`: also restore what was reset or removed
 * @returns {{answers: number, lessons: number, restorable: number}} the numbers of answers and lessons that are new or changed, and of
 *   those in the file that are missing since they were reset or removed
 * @throws {ImportError}
 */
export function importText(progress, text, { restore = false } = {}) {
  const file = readFile(text, progress.course)
  let summary = null
  const isStored = progress.replace((state, tick) => {
    const union = merge(state, file)
    const renewed = restore ? restoreMissing(union, file, tick) : union
    summary = { ...countChanges(renewed, state), restorable: countMissing(renewed, file) }
    return renewed
  })
  if (!isStored) throw new ImportError('full')
  return summary
}

/** Restore, with new ticks, what the file has and the state lacks, since it was reset or removed. */
function restoreMissing(state, file, tick) {
  const renew = ({ gone, values, recalls } = NOTHING, old) => {
    const withNewTick = (value) => ({ ...value, tick: tick() })
    const all = new Map(values)
    for (const [name, value] of old.values) if (!all.has(name)) all.set(name, withNewTick(value))
    return { gone, values: all, recalls: values.size > 0 ? recalls : old.recalls.map(withNewTick) }
  }
  const missing = (entries, current) => {
    const lost = [...entries].filter(([key, entry]) => isMissing(current?.get(key), entry))
    return new Map(lost.map(([key, entry]) => [key, renew(current?.get(key), entry)]))
  }
  const answers = new Map([...file.answers].map(([quiz, entries]) => [quiz, missing(entries, state.answers.get(quiz))]))
  return merge(state, { reset: state.reset, answers, lessons: missing(file.lessons, state.lessons) })
}

/** Whether an entry of a file has a value that the current entry lacks. */
const isMissing = (current, entry) => [...entry.values.keys()].some((name) => !current?.values.has(name))

/** The entries of a state: answers or lessons, each with its counterpart in another state, if there is one. */
function* pairs(state, other) {
  for (const [quiz, entries] of state.answers) {
    for (const [key, entry] of entries) yield { kind: 'answers', entry, counterpart: other.answers.get(quiz)?.get(key) }
  }
  for (const [id, entry] of state.lessons) yield { kind: 'lessons', entry, counterpart: other.lessons.get(id) }
}

/** Count the answers and lessons of a file that a state lacks. */
const countMissing = (state, file) => [...pairs(file, state)].filter(({ entry, counterpart }) => isMissing(counterpart, entry)).length

function countChanges(state, previous) {
  const counts = { answers: 0, lessons: 0 }
  for (const { kind, entry, counterpart } of pairs(state, previous)) counts[kind] += differs(entry, counterpart)
  return counts
}

/** 1 if an entry has changed, else 0. */
function differs(entry, previous) {
  if (entry === previous || entry.values.size === 0) return 0
  return Number([...entry.values].some(([name, { tick }]) => previous?.values.get(name)?.tick !== tick))
}
