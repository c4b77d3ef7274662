/**
 * A reader's progress through a course, kept in the reader's browser and nowhere else.
 *
 * Entry point: `openProgress(course)`. All of a course is one text under `coursebuild.progress.COURSE`; see state.js for what is in it
 * and how two such texts are merged.
 *
 * 1. Before each change the text is read again, and merged where another tab has written it since.
 * 2. The changed state is written. Two tabs that write at the very same moment can lose each other's text for that moment: each hears
 *    of the other's by the storage event, merges it, and writes what the other lacks.
 * 3. Where the storage is closed or full, or holds what only a newer version understands, changes hold for this page alone, and
 *    `trouble()` says so. A damaged text is put aside before anything is written; what can be read of it is taken over.
 */

import { PREFIX } from './kept.js'
import { counts } from './schedule.js'
import { answerOf, canonical, emptyState, encode, isTime, latest, latestRecalls, merge, NOTHING } from './state.js'
import { placeOf, readOf, understood } from './state.js'

export { matchQuestions } from './match.js'

const LAST_TIME = Date.UTC(9999, 11, 31)

/**
 * @typedef {object} Answer
 * @property {string} kind of the question
 * @property {unknown} given what the learner entered: plain JSON values
 * @property {boolean | null} right `null`: not decided
 * @property {number} tries
 * @property {number} hints so many were opened
 * @property {number} number of the question in its quiz, from 1
 * @property {string} lesson its id
 * @property {string} at when, ISO
 */

/** The browser's storage; `null` where it is closed to the page. */
function ownStorage() {
  try {
    return globalThis.localStorage ?? null
  } catch {
    return null
  }
}

/**
 * @param {string} course its key
 * @param {Storage | null} storage
 * @param {{now?: () => number, events?: EventTarget}} around the clock, ms, and where storage events arrive
 */
export function openProgress(course, storage = ownStorage(), { now = Date.now, events = globalThis } = {}) {
  return new Progress(course, storage, now, events)
}

class Progress {
  #name
  #course
  #storage
  #now
  #state = emptyState()
  #clock = 0
  /** The text that the state was last read from or written as; `null` where there was none. */
  #text = null
  #trouble = null
  /** Whether what is kept must not be written over. */
  #held = false
  #listeners = new Set()
  #begun = false

  constructor(course, storage, now, events) {
    this.#course = course
    this.#name = `${PREFIX}${course}`
    this.#storage = storage
    // A clock may be set to before 1970, or to years that no date can be of.
    this.#now = () => Math.min(Math.max(Math.floor(now()), 0), LAST_TIME)
    events?.addEventListener?.('storage', (event) => {
      if (this.#begun && (event.key === this.#name || event.key === null)) this.refresh()
    })
  }

  /** The state; the storage is first read when somebody asks. */
  get #known() {
    if (!this.#begun) this.#read()
    return this.#state
  }

  // --- answers

  /** @returns {Answer | null} */
  get(quiz, key) {
    const answer = this.#known.answers.get(quiz)?.get(key)?.values.get('answer')
    return answer ? plain(answer) : null
  }

  /**
   * Note an answer. A verdict after another number of tries than before, or another verdict, is a recall for the review; `recall` says
   * so where whoever calls knows better.
   * @param {Answer} answer
   */
  put(quiz, key, answer, { recall } = {}) {
    const now = this.#now()
    const value = answerOf({ ...answer, given: structuredClone(answer.given), at: isTime(answer.at) ? answer.at : new Date(now).toISOString() })
    this.#read()
    const entry = this.#state.answers.get(quiz)?.get(key) ?? NOTHING
    const before = entry.values.get('answer')
    if (before && !recall && canonical({ ...value, at: before.at }) === canonical(plain(before))) return
    const told = recall ?? (before?.tries !== value.tries || before?.right !== value.right)
    const made = { tick: this.#tick(now), right: value.right, at: now }
    const kept = told && value.right !== null && counts(entry.recalls, made)
    const values = new Map(entry.values).set('answer', { tick: made.tick, ...value })
    const recalls = kept ? latestRecalls([...entry.recalls, made]) : entry.recalls
    this.#setAnswer(quiz, key, { gone: entry.gone, values, recalls })
    this.#write()
  }

  /** All answers, each with its recalls. */
  all() {
    const found = []
    for (const [quiz, entries] of this.#known.answers) {
      for (const [key, { values, recalls }] of entries) {
        const answer = values.get('answer')
        if (answer) found.push({ quiz, key, ...plain(answer), recalls })
      }
    }
    return found
  }

  /** Forget an answer, here and wherever this state is merged. */
  forget(quiz, key) {
    this.#read()
    this.#setAnswer(quiz, key, { ...NOTHING, gone: this.#tick() })
    this.#write()
  }

  /** Let an answer go by another key: that of the same question, whose text has changed. One that is there already stays. */
  rename(quiz, from, to) {
    this.#read()
    const old = this.#state.answers.get(quiz)?.get(from)
    const have = this.#state.answers.get(quiz)?.get(to) ?? NOTHING
    if (!old?.values.size || have.values.size || from === to) return
    const anew = (value) => ({ ...value, tick: this.#tick() })
    const values = new Map([...old.values].map(([name, value]) => [name, anew(value)]))
    this.#setAnswer(quiz, to, { gone: have.gone, values, recalls: old.recalls.map(anew) })
    this.#setAnswer(quiz, from, { ...NOTHING, gone: this.#tick() })
    this.#write()
  }

  // --- lessons

  /**
   * Lessons by id. `marked`: somebody has said whether it is read; `at`: when it was last touched.
   * @returns {Map<string, {read: boolean, marked: boolean, place: {section: string, title: string, share: number, at: string} | null,
   *   at: string}>}
   */
  lessons() {
    const found = new Map()
    for (const [id, { values }] of this.#known.lessons) {
      const read = values.get('read')
      const place = values.get('place')
      const at = !read || (place && place.tick > read.tick) ? place?.at : read.at
      if (at) found.set(id, { read: read?.value ?? false, marked: read !== undefined, place: place ? plain(place) : null, at })
    }
    return found
  }

  /**
   * Note how far a lesson is read.
   * @param {{at: string, title?: string, share: number}} place the anchor of a section (empty: the beginning), its title, and the share
   *   of the lesson that has been in sight, 0 to 1
   */
  readLesson(id, { at, title = '', share }) {
    const time = new Date(this.#now()).toISOString()
    this.#setLesson(id, 'place', placeOf({ section: at, title: title.slice(0, 300), share, at: time }))
  }

  /** Note that a lesson is read, or that it is not. */
  markLesson(id, read) {
    this.#setLesson(id, 'read', readOf({ value: read, at: new Date(this.#now()).toISOString() }))
  }

  /** Forget a lesson, but not its answers. */
  forgetLesson(id) {
    this.#read()
    this.#putLesson(id, { ...NOTHING, gone: this.#tick() })
    this.#write()
  }

  /** The lesson in which the reader was last, and where; `null` before the first. */
  last() {
    let found = null
    for (const [id, { values }] of this.#known.lessons) {
      const place = values.get('place')
      if (place && (found === null || place.tick > found.tick || (place.tick === found.tick && id > found.id))) {
        found = { id, ...place }
      }
    }
    return found && { id: found.id, ...plain(found) }
  }

  // --- the whole

  /** Call `fn({here})` after each change, made here or in another tab. @returns {() => void} ends it */
  onChange(fn) {
    if (!this.#begun) this.#read()
    this.#listeners.add(fn)
    return () => this.#listeners.delete(fn)
  }

  /** Read again what is kept: another tab may have changed it while this page could not hear of it. */
  refresh() {
    const before = this.#known
    this.#read()
    if (this.#text !== null && before !== this.#state && encode(this.#state, this.#course) !== this.#text) this.#tryWrite()
    if (before !== this.#state) this.#tell(false)
  }

  /** Why nothing is kept beyond this page, or what is wrong with what is: `closed`, `full`, `newer`, `damaged`; else `null`. */
  trouble() {
    if (!this.#begun) this.#read()
    return this.#trouble
  }

  exportText() {
    this.#read()
    return encode(this.#state, this.#course)
  }

  get course() {
    return this.#course
  }

  /**
   * Take another state, made of the one that is: `make(state, tick)`, where `tick` gives ticks. See exchange.js.
   * @returns {boolean} `false` where there is no room for it: then nothing is changed
   */
  replace(make) {
    this.#read()
    const [state, known, trouble] = [this.#state, this.#text, this.#trouble]
    this.#take(make(state, () => this.#tick()))
    if (encode(this.#state, this.#course) !== known && !this.#tryWrite() && this.#trouble === 'full') {
      this.#take(state)
      this.#trouble = trouble
      return false
    }
    this.#tell(true)
    return true
  }

  /** Forget everything, here and in other tabs. */
  reset() {
    this.#read()
    this.#take({ ...emptyState(), reset: this.#tick() })
    this.#write()
  }

  /** What was put aside because it was damaged; `null` where there is none. */
  aside() {
    try {
      return this.#storage?.getItem(`${this.#name}.damaged`) ?? null
    } catch {
      return null
    }
  }

  dropAside() {
    try {
      this.#storage?.removeItem(`${this.#name}.damaged`)
    } catch {
      // The storage is closed: there is nothing to drop.
    }
  }

  // --- inner

  #tick(now = this.#now()) {
    this.#clock = Math.max(now, this.#clock + 1)
    return this.#clock
  }

  #take(state) {
    this.#state = state
    this.#clock = Math.max(this.#clock, latest(state))
  }

  #setAnswer(quiz, key, entry) {
    const entries = new Map(this.#state.answers.get(quiz)).set(key, entry)
    this.#state = { ...this.#state, answers: new Map(this.#state.answers).set(quiz, entries) }
  }

  #putLesson(id, entry) {
    this.#state = { ...this.#state, lessons: new Map(this.#state.lessons).set(id, entry) }
  }

  #setLesson(id, name, value) {
    this.#read()
    const entry = this.#state.lessons.get(id) ?? NOTHING
    this.#putLesson(id, { ...entry, values: new Map(entry.values).set(name, { tick: this.#tick(), ...value }) })
    this.#write()
  }

  /** Take in what is kept, where it is another text than the one known. */
  #read() {
    this.#begun = true
    let text
    try {
      if (this.#storage === null) throw new Error('no storage')
      text = this.#storage.getItem(this.#name)
    } catch {
      this.#trouble = 'closed'
      return
    }
    if (this.#trouble === 'closed') this.#trouble = null
    if (text === this.#text) return
    const known = this.#text
    this.#text = text
    if (text === null) {
      // Somebody has emptied the browser's storage: what this page remembers must not come back.
      if (known !== null) this.#take(emptyState())
      this.#held = false
      this.#trouble = null
      return
    }
    const { state, trouble } = understood(text, this.#course)
    this.#held = trouble === 'newer' || (trouble === 'damaged' && !this.#putAside(text))
    this.#trouble = trouble
    if (state) this.#take(merge(this.#state, state))
  }

  #putAside(text) {
    try {
      if (this.aside() !== text) this.#storage.setItem(`${this.#name}.damaged`, text)
      return true
    } catch {
      return false
    }
  }

  #write() {
    this.#tryWrite()
    this.#tell(true)
  }

  /** @returns {boolean} whether the state is kept */
  #tryWrite() {
    if (this.#held || this.#trouble === 'closed') return false
    const text = encode(this.#state, this.#course)
    try {
      this.#storage.setItem(this.#name, text)
    } catch {
      this.#trouble = 'full'
      return false
    }
    this.#text = text
    this.#trouble = null
    return true
  }

  #tell(here) {
    for (const fn of [...this.#listeners]) fn({ here })
  }
}

const plain = ({ tick, id, ...value }) => value
