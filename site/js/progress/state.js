/**
 * A reader's progress through a course, as a value that can be merged.
 *
 * A state holds the answers to questions, the lessons read, and the time of the last reset. Every value in it has a tick, an
 * integer that grows with each change: the time in ms if that is later than all known ticks, else the next integer. So a clock that
 * goes backwards, or another device whose clock is wrong, cannot reverse the order (L. Lamport, “Time, clocks, and the ordering
 * of events in a distributed system”, 1978, with the wall clock as in S. Kulkarni and others, “Logical physical clocks”, 2014).
 *
 * `merge` is commutative, associative and idempotent: of two versions of a value the later wins, of equally late ones the one
 * whose text sorts last; recalls are a set of which the latest stay; what is not later than a reset, or than its own removal, is
 * dropped. So it does not matter in which order, or how often, tabs and devices exchange their states.
 *
 * In memory: `{ reset, answers: Map(quiz → Map(key → Entry)), lessons: Map(id → Entry) }` with
 * `Entry = { gone, values: Map(name → { tick, … }), recalls: [{ tick, right, at }] }`. An answer has the one value `answer`, a lesson
 * has `read` and `place`. Nothing changes a state or an entry once it is made.
 */

const VERSION = 1
/** The latest tick that is accepted from a file or another tab; above it there is room for more changes with exact integers. */
export const LAST_TICK = 2 ** 52
/** The number of recalls of a question that are stored, the latest ones. */
export const RECALLS = 16
const DEPTH = 4

/** Something in a state is invalid; `path` says what. */
export class StateError extends Error {
  constructor(path) {
    super(`not a value of this kind: ${path}`)
    this.path = path
  }
}

export const NOTHING = Object.freeze({ gone: 0, values: new Map(), recalls: Object.freeze([]) })

/** A state without progress. */
export function emptyState() {
  return { reset: 0, answers: new Map(), lessons: new Map() }
}

export function latest(state) {
  let tick = state.reset
  for (const entry of entriesOf(state)) {
    tick = Math.max(tick, entry.gone)
    for (const value of entry.values.values()) tick = Math.max(tick, value.tick)
    for (const recall of entry.recalls) tick = Math.max(tick, recall.tick)
  }
  return tick
}

function* entriesOf(state) {
  for (const entries of state.answers.values()) yield* entries.values()
  yield* state.lessons.values()
}

// --- merge

/** Merge two states. */
export function merge(first, second) {
  const reset = Math.max(first.reset, second.reset)
  const quizzes = joinMaps(first.answers, second.answers, (a, b) => {
    const entries = joinMaps(a, b, (x, y) => mergeEntries(x, y, reset))
    return entries.size ? entries : undefined
  })
  return { reset, answers: quizzes, lessons: joinMaps(first.lessons, second.lessons, (a, b) => mergeEntries(a, b, reset)) }
}

/** Merge two maps by `mergeValues`, which gets `undefined` if a map lacks the key, and returns it for a key to be left out. */
function joinMaps(first = new Map(), second = new Map(), mergeValues) {
  const union = new Map()
  for (const [key, value] of first) union.set(key, mergeValues(value, second.get(key)))
  for (const [key, value] of second) if (!first.has(key)) union.set(key, mergeValues(undefined, value))
  for (const [key, value] of union) if (value === undefined) union.delete(key)
  return union
}

/** Merge two entries, given the time of a reset; `undefined` if nothing is left. */
function mergeEntries(first = NOTHING, second = NOTHING, reset = 0) {
  const removedAt = Math.max(first.gone, second.gone)
  const cutoff = Math.max(removedAt, reset)
  const gone = removedAt > reset ? removedAt : 0
  if (second === NOTHING || first === NOTHING) {
    const only = second === NOTHING ? first : second
    if (gone === only.gone && allLater(only, cutoff)) return isBare(only) ? undefined : only
  }
  const values = joinMaps(first.values, second.values, (a, b) => {
    const value = a && b ? laterOf(a, b) : a ?? b
    return value.tick > cutoff ? value : undefined
  })
  const recalls = latestRecalls([...first.recalls, ...second.recalls].filter(({ tick }) => tick > cutoff))
  const entry = { gone, values, recalls }
  return isBare(entry) ? undefined : entry
}

const isBare = ({ gone, values, recalls }) => gone === 0 && values.size === 0 && recalls.length === 0
const allLater = ({ values, recalls }, cutoff) =>
  [...values.values()].every(({ tick }) => tick > cutoff) && recalls.every(({ tick }) => tick > cutoff)

function laterOf(first, second) {
  if (first.tick !== second.tick) return first.tick > second.tick ? first : second
  return canonical(first) >= canonical(second) ? first : second
}

const recallOrder = (a, b) => a.tick - b.tick || a.right - b.right || a.at - b.at

/** The latest recalls, in order and without duplicates. */
export function latestRecalls(recalls) {
  const sorted = [...recalls].sort(recallOrder)
  return sorted.filter((recall, i) => i === 0 || recallOrder(sorted[i - 1], recall) !== 0).slice(-RECALLS)
}

// --- text

/** JSON with the keys of objects in order: equal values have equal texts. */
export function canonical(value) {
  const sorted = (item) => Object.fromEntries(Object.entries(item).sort(([a], [b]) => (a < b ? -1 : 1)))
  return JSON.stringify(value, (_, item) => (isObject(item) ? sorted(item) : item))
}

const plainMap = (map, plain) => Object.fromEntries([...map].map(([key, value]) => [key, plain(value)]))

function plainEntry({ gone, values, recalls }) {
  const fields = Object.fromEntries(values)
  if (gone) fields.gone = gone
  if (recalls.length) fields.recalls = recalls.map(({ tick, right, at }) => [tick, Number(right), at])
  return fields
}

/** A state as text: equal states have equal texts. */
export function encode({ reset, answers, lessons }, course) {
  const plain = { answers: plainMap(answers, (entries) => plainMap(entries, plainEntry)), lessons: plainMap(lessons, plainEntry) }
  return `${canonical({ coursebuild: 'progress', version: VERSION, course, reset, ...plain })}\n`
}

/**
 * Decode a state from parsed JSON. An invalid entry is passed to `bad(error)`, which may throw, and left out.
 * @throws {StateError} if it is no state at all
 */
export function decode(data, bad) {
  if (!isObject(data) || !isObject(data.answers) || !isObject(data.lessons)) throw new StateError('the whole')
  const state = emptyState()
  state.reset = tickOf(data.reset, 'reset')
  const add = (map, key, path, read, value) => {
    try {
      map.set(key, read(value, path))
    } catch (error) {
      if (!(error instanceof StateError)) throw error
      bad(error)
    }
  }
  for (const [quiz, entries] of Object.entries(data.answers)) {
    const map = new Map()
    for (const [key, value] of Object.entries(isObject(entries) ? entries : { '': null })) {
      add(map, key, `answers, ${quiz}, ${key}`, readAnswer, value)
    }
    if (map.size) state.answers.set(quiz, map)
  }
  for (const [id, value] of Object.entries(data.lessons)) add(state.lessons, id, `lessons, ${id}`, readLesson, value)
  return merge(state, emptyState())
}

/** What is wrong with the head of parsed JSON: `kind`, `version` (a newer one) or `course`; else ''. */
export function wrongHead(data, course) {
  if (data?.coursebuild !== 'progress') return 'kind'
  if (data.version !== VERSION) return data.version > VERSION ? 'version' : 'kind'
  return data.course === course ? '' : 'course'
}

/** Parse a stored text as far as possible; `trouble` is `newer`, `damaged` or `null`. */
export function parseState(text, course) {
  let whole = true
  try {
    const data = JSON.parse(text)
    const wrong = wrongHead(data, course)
    if (wrong !== '') return { state: null, trouble: wrong === 'version' ? 'newer' : 'damaged' }
    const state = decode(data, () => {
      whole = false
    })
    return { state, trouble: whole ? null : 'damaged' }
  } catch {
    return { state: null, trouble: 'damaged' }
  }
}

// --- checks

const isObject = (value) => value !== null && typeof value === 'object' && !Array.isArray(value)

function tickOf(value, path) {
  if (!Number.isSafeInteger(value) || value < 0 || value > LAST_TICK) throw new StateError(path)
  return value
}

function check(isValid, path) {
  if (!isValid) throw new StateError(path)
}

function readEntry(data, path, readers) {
  check(isObject(data), path)
  const values = new Map()
  let gone = 0
  let recalls = []
  for (const [name, value] of Object.entries(data)) {
    if (name === 'gone') gone = tickOf(value, `${path}, gone`)
    else if (name === 'recalls') recalls = readRecalls(value, `${path}, recalls`)
    else {
      check(Object.hasOwn(readers, name) && isObject(value), `${path}, ${name}`)
      values.set(name, { tick: tickOf(value.tick, `${path}, ${name}`), ...readers[name](value, `${path}, ${name}`) })
    }
  }
  return { gone, values, recalls }
}

function readRecalls(data, path) {
  check(Array.isArray(data), path)
  return latestRecalls(
    data.map((recall) => {
      check(Array.isArray(recall) && recall.length === 3 && (recall[1] === 0 || recall[1] === 1), path)
      return { tick: tickOf(recall[0], path), right: recall[1] === 1, at: tickOf(recall[2], path) }
    }),
  )
}

const readAnswer = (data, path) => readEntry(data, path, { answer: answerOf })
const readLesson = (data, path) => readEntry(data, path, { read: readOf, place: placeOf })

const isCount = (value) => Number.isSafeInteger(value) && value >= 0
/** Whether a value is a time in the format of `toISOString`, with a year of four digits. */
export const isTime = (value) => typeof value === 'string' && /^\d{4}-\d\d-\d\dT[\d:.]+Z$/.test(value) && Number.isFinite(Date.parse(value))

/** Check an answer and return it without other fields. @throws {StateError} */
export function answerOf({ kind, given, right, tries, hints, number, lesson, at }, path = 'answer') {
  check(typeof kind === 'string' && typeof lesson === 'string' && isGiven(given, DEPTH) && isTime(at), path)
  check((right === null || typeof right === 'boolean') && isCount(tries) && isCount(hints) && isCount(number), path)
  return { kind, given, right, tries, hints, number, lesson, at }
}

function isGiven(value, depth) {
  if (value === null || typeof value === 'string' || typeof value === 'boolean') return true
  if (typeof value === 'number') return Number.isFinite(value)
  if (typeof value !== 'object' || depth === 0) return false
  return Object.values(value).every((part) => isGiven(part, depth - 1))
}

/** Check the mark that a lesson is read, or not. @throws {StateError} */
export function readOf({ value, at }, path = 'read') {
  check(typeof value === 'boolean' && isTime(at), path)
  return { value, at }
}

/** Check a place in a lesson: the anchor and the title of a section, and the share that was in sight. @throws {StateError} */
export function placeOf({ section, title, share, at }, path = 'place') {
  check(typeof section === 'string' && typeof title === 'string' && isTime(at), path)
  check(typeof share === 'number' && share >= 0 && share <= 1, path)
  return { section, title, share, at }
}
