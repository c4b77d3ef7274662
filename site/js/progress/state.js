/**
 * What is known of a reader's way through a course, as a value that can be merged.
 *
 * A state holds the answers to questions, the lessons read, and the time of the last reset. Every value in it has a tick, a whole
 * number that grows with each change: the time in ms where that is later than all ticks known, else the next number. So a clock that
 * goes backwards, or another device whose clock is wrong, puts nothing in the wrong order (L. Lamport, “Time, clocks, and the ordering
 * of events in a distributed system”, 1978, with the wall clock as in S. Kulkarni and others, “Logical physical clocks”, 2014).
 *
 * `merge` is commutative, associative and idempotent, whatever the states: of one value the later counts, of equally late ones the one
 * whose text comes last; recalls are a set of which the latest stay; what is not later than a reset, or than its own removal, is gone.
 * So it does not matter which of two tabs or devices learns of what first, or how often.
 *
 * In memory: `{ reset, answers: Map(quiz → Map(key → Entry)), lessons: Map(id → Entry) }` with
 * `Entry = { gone, values: Map(name → { tick, … }), recalls: [{ tick, right, at }] }`. An answer has the one value `answer`, a lesson
 * has `read` and `place`. Nothing changes a state or an entry once it is made.
 */

export const VERSION = 1
/** The latest tick that is taken from elsewhere: so many changes remain that can be counted exactly. */
export const LAST_TICK = 2 ** 52
/** So many recalls of a question are kept, the latest. */
export const RECALLS = 16
const DEPTH = 4

/** Something in a state that is not as it should be; `where` names the place. */
export class StateError extends Error {
  constructor(where) {
    super(`not a value of this kind: ${where}`)
    this.where = where
  }
}

export const NOTHING = Object.freeze({ gone: 0, values: new Map(), recalls: Object.freeze([]) })

/** A state of which nothing is known. */
export function emptyState() {
  return { reset: 0, answers: new Map(), lessons: new Map() }
}

/** The latest tick in a state. */
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

/** What is known to either of two states. */
export function merge(one, other) {
  const reset = Math.max(one.reset, other.reset)
  const quizzes = joined(one.answers, other.answers, (a, b) => {
    const entries = joined(a, b, (x, y) => mergeEntries(x, y, reset))
    return entries.size ? entries : undefined
  })
  return { reset, answers: quizzes, lessons: joined(one.lessons, other.lessons, (a, b) => mergeEntries(a, b, reset)) }
}

/** Two maps as one; what `merged` gives no value for is left out. It gets `undefined` where a map lacks the key. */
function joined(one = new Map(), other = new Map(), merged) {
  const all = new Map()
  for (const [key, value] of one) all.set(key, merged(value, other.get(key)))
  for (const [key, value] of other) if (!one.has(key)) all.set(key, merged(undefined, value))
  for (const [key, value] of all) if (value === undefined) all.delete(key)
  return all
}

/** One entry of two, as of a reset; `undefined` where nothing is left of it. */
export function mergeEntries(one = NOTHING, other = NOTHING, reset = 0) {
  const removed = Math.max(one.gone, other.gone)
  const since = Math.max(removed, reset)
  const gone = removed > reset ? removed : 0
  if (other === NOTHING || one === NOTHING) {
    const only = other === NOTHING ? one : other
    if (gone === only.gone && allLater(only, since)) return isBare(only) ? undefined : only
  }
  const values = joined(one.values, other.values, (a, b) => {
    const value = a && b ? later(a, b) : a ?? b
    return value.tick > since ? value : undefined
  })
  const recalls = latestRecalls([...one.recalls, ...other.recalls].filter(({ tick }) => tick > since))
  const entry = { gone, values, recalls }
  return isBare(entry) ? undefined : entry
}

const isBare = ({ gone, values, recalls }) => gone === 0 && values.size === 0 && recalls.length === 0
const allLater = ({ values, recalls }, since) =>
  [...values.values()].every(({ tick }) => tick > since) && recalls.every(({ tick }) => tick > since)

function later(one, other) {
  if (one.tick !== other.tick) return one.tick > other.tick ? one : other
  return canonical(one) >= canonical(other) ? one : other
}

const recallOrder = (a, b) => a.tick - b.tick || a.right - b.right || a.at - b.at

/** The latest of some recalls, each once, in order. */
export function latestRecalls(recalls) {
  const sorted = [...recalls].sort(recallOrder)
  return sorted.filter((recall, i) => i === 0 || recallOrder(sorted[i - 1], recall) !== 0).slice(-RECALLS)
}

// --- text

/** JSON with the keys of objects in order: equal values have equal texts. */
export function canonical(value) {
  if (Array.isArray(value)) return `[${value.map(canonical).join(',')}]`
  if (value === null || typeof value !== 'object') return JSON.stringify(value)
  const keys = Object.keys(value).sort()
  return `{${keys.map((key) => `${JSON.stringify(key)}:${canonical(value[key])}`).join(',')}}`
}

const texts = new WeakMap()

/** The text of a map, kept while the map is in use: of a large state only what changed is written anew. */
function mapText(map, textOf) {
  let text = texts.get(map)
  if (text === undefined) {
    const keys = [...map.keys()].sort()
    text = `{${keys.map((key) => `${JSON.stringify(key)}:${textOf(map.get(key))}`).join(',')}}`
    texts.set(map, text)
  }
  return text
}

/** The same as `canonical`, faster for what there is most of. */
function valueText(name, value) {
  if (name !== 'answer') return canonical(value)
  const { at, given, hints, kind, lesson, number, right, tick, tries } = value
  const texts = [at, kind, lesson].map((text) => JSON.stringify(text))
  const before = `{"at":${texts[0]},"given":${canonical(given)},"hints":${hints},"kind":${texts[1]},"lesson":${texts[2]}`
  return `${before},"number":${number},"right":${right},"tick":${tick},"tries":${tries}}`
}

function entryText(entry) {
  let text = texts.get(entry)
  if (text === undefined) {
    const fields = [...entry.values].map(([name, value]) => `${JSON.stringify(name)}:${valueText(name, value)}`).sort()
    if (entry.gone) fields.push(`"gone":${entry.gone}`)
    if (entry.recalls.length) {
      fields.push(`"recalls":[${entry.recalls.map(({ tick, right, at }) => `[${tick},${Number(right)},${at}]`).join(',')}]`)
    }
    text = `{${fields.join(',')}}`
    texts.set(entry, text)
  }
  return text
}

/** A state as text: equal states have equal texts. */
export function encode(state, course) {
  const head = `{"coursebuild":"progress","version":${VERSION},"course":${JSON.stringify(course)},"reset":${state.reset}`
  const answers = mapText(state.answers, (entries) => mapText(entries, entryText))
  return `${head},\n"answers":${answers},\n"lessons":${mapText(state.lessons, entryText)}}\n`
}

/**
 * A state from what JSON gave. Of an entry that is not as it should be, `bad(error)` is told, and it is left out; `bad` may throw.
 * @throws {StateError} where it is no state at all
 */
export function decode(data, bad) {
  if (!isObject(data) || !isObject(data.answers) || !isObject(data.lessons)) throw new StateError('the whole')
  const state = emptyState()
  state.reset = tickOf(data.reset, 'reset')
  const add = (map, key, where, read, value) => {
    try {
      map.set(key, read(value, where))
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

/** What a kept text says, as far as it can be read, and what is wrong with it: `newer`, `damaged` or `null`. */
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

// --- checks

const isObject = (value) => value !== null && typeof value === 'object' && !Array.isArray(value)

function tickOf(value, where) {
  if (!Number.isSafeInteger(value) || value < 0 || value > LAST_TICK) throw new StateError(where)
  return value
}

function must(right, where) {
  if (!right) throw new StateError(where)
}

function readEntry(data, where, readers) {
  must(isObject(data), where)
  const values = new Map()
  let gone = 0
  let recalls = []
  for (const [name, value] of Object.entries(data)) {
    if (name === 'gone') gone = tickOf(value, `${where}, gone`)
    else if (name === 'recalls') recalls = readRecalls(value, `${where}, recalls`)
    else {
      must(Object.hasOwn(readers, name) && isObject(value), `${where}, ${name}`)
      values.set(name, { tick: tickOf(value.tick, `${where}, ${name}`), ...readers[name](value, `${where}, ${name}`) })
    }
  }
  return { gone, values, recalls }
}

function readRecalls(data, where) {
  must(Array.isArray(data), where)
  return latestRecalls(
    data.map((recall) => {
      must(Array.isArray(recall) && recall.length === 3 && (recall[1] === 0 || recall[1] === 1), where)
      return { tick: tickOf(recall[0], where), right: recall[1] === 1, at: tickOf(recall[2], where) }
    }),
  )
}

const readAnswer = (data, where) => readEntry(data, where, { answer: answerOf })
const readLesson = (data, where) => readEntry(data, where, { read: readOf, place: placeOf })

const isCount = (value) => Number.isSafeInteger(value) && value >= 0
/** Whether a value is a time as `toISOString` gives it, in years of four digits. */
export const isTime = (value) => typeof value === 'string' && /^\d{4}-\d\d-\d\dT[\d:.]+Z$/.test(value) && Number.isFinite(Date.parse(value))

/** An answer with its own fields and no others. @throws {StateError} */
export function answerOf({ kind, given, right, tries, hints, number, lesson, at }, where = 'answer') {
  must(typeof kind === 'string' && typeof lesson === 'string' && isGiven(given, DEPTH) && isTime(at), where)
  must((right === null || typeof right === 'boolean') && isCount(tries) && isCount(hints) && isCount(number), where)
  return { kind, given, right, tries, hints, number, lesson, at }
}

function isGiven(value, depth) {
  if (value === null || typeof value === 'string' || typeof value === 'boolean') return true
  if (typeof value === 'number') return Number.isFinite(value)
  if (typeof value !== 'object' || depth === 0) return false
  return Object.values(value).every((part) => isGiven(part, depth - 1))
}

/** Whether a lesson is read. @throws {StateError} */
export function readOf({ value, at }, where = 'read') {
  must(typeof value === 'boolean' && isTime(at), where)
  return { value, at }
}

/** How far a lesson is read: the anchor and the title of a section, and the share that was in sight. @throws {StateError} */
export function placeOf({ section, title, share, at }, where = 'place') {
  must(typeof section === 'string' && typeof title === 'string' && isTime(at), where)
  must(typeof share === 'number' && share >= 0 && share <= 1, where)
  return { section, title, share, at }
}
