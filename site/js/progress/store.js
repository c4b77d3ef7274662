/**
 * A reader's progress through a course, stored in the reader's browser and nowhere else.
 *
 * Entry point: `openProgress(course)`. The progress in a course is one text under `coursebuild.progress.COURSE`; state.js describes it
 * and merges two such texts.
 *
 * 1. Before each change the text is read again, and merged if another tab has written it since.
 * 2. The changed state is written. Two tabs that write at the same moment can overwrite each other's text for that moment: each gets
 *    the other's by the storage event, merges it, and writes what the other lacks.
 * 3. If the storage is blocked or full, or holds the text of a newer version, changes hold for this page only, and `trouble()` says
 *    so. A damaged text is backed up before anything is written; its valid parts are taken over.
 */

import { openStorage, readChoice, writeChoice } from '../page/choices.js'
import { PREFIX } from './storage.js'
import { changesSchedule } from './schedule.js'
import { answerOf, canonical, emptyState, encode, isTime, latest, latestRecalls, merge, NOTHING } from './state.js'
import { placeOf, readOf, parseState } from './state.js'

const LAST_TIME = Date.UTC(9999, 11, 31)

/**
 * @typedef {object} Answer
 * @property {string} kind of the question
 * @property {unknown} given what the learner entered: plain JSON values
 * @property {boolean | null} right `null`: not decided
 * @property {number} tries
 * @property {number} hints number of opened hints
 * @property {number} number of the question in its quiz, from 1
 * @property {string} lesson its id
 * @property {string} at when, ISO
 */

/**
 * @param {string} course its key
 * @param {Storage | null} storage
 * @param {{now?: () => number, events?: EventTarget}} services the clock, ms, and the target of storage events
 */
export function openProgress(course, storage = openStorage(), { now = Date.now, events = globalThis } = {}) {
  return new Progress(course, storage, now, events)
}

class Progress {
  #name
  #course
  #storage
  #now
  #state = emptyState()
  #clock = 0
  /** The text that was last read or written; `null` if there was none. */
  #text = null
  #trouble = null
  /** Whether the stored text must not be overwritten. */
  #isReadOnly = false
  #listeners = new Set()
  #hasRead = false

  constructor(course, storage, now, events) {
    this.#course = course
    this.#name = `${PREFIX}${course}`
    this.#storage = storage
    // A clock may be set to before 1970, or beyond the largest date.
    this.#now = () => Math.min(Math.max(Math.floor(now()), 0), LAST_TIME)
    events?.addEventListener?.('storage', (event) => {
      if (this.#hasRead && (event.key === this.#name || event.key === null)) this.refresh()
    })
  }

  /** The state; the storage is read on first use. */
  get #current() {
    if (!this.#hasRead) this.#read()
    return this.#state
  }

  // --- answers

  /** @returns {Answer | null} */
  get(quiz, key) {
    const answer = this.#current.answers.get(quiz)?.get(key)?.values.get('answer')
    return answer ? /** @type {any} */ (plain(answer)) : null
  }

  /**
   * Record an answer. A new verdict, or one after another number of tries, is a recall for the review, unless `recall` decides.
   * @param {Answer} answer
   */
  put(quiz, key, answer, { recall } = /** @type {{recall?: boolean}} */ ({})) {
    const now = this.#now()
    const value = answerOf({ ...answer, given: structuredClone(answer.given), at: isTime(answer.at) ? answer.at : new Date(now).toISOString() })
    this.#read()
    const entry = this.#state.answers.get(quiz)?.get(key) ?? NOTHING
    const previous = entry.values.get('answer')
    if (previous && !recall && canonical({ ...value, at: previous.at }) === canonical(plain(previous))) return
    const isRecall = recall ?? (previous?.tries !== value.tries || previous?.right !== value.right)
    const newRecall = { tick: this.#tick(now), right: value.right, at: now }
    const isKept = isRecall && value.right !== null && changesSchedule(entry.recalls, newRecall)
    const values = new Map(entry.values).set('answer', { tick: newRecall.tick, ...value })
    const recalls = isKept ? latestRecalls([...entry.recalls, newRecall]) : entry.recalls
    this.#setAnswer(quiz, key, { gone: entry.gone, values, recalls })
    this.#write()
  }

  /** All answers, each with its recalls. */
  all() {
    const answers = []
    for (const [quiz, entries] of this.#current.answers) {
      for (const [key, { values, recalls }] of entries) {
        const answer = values.get('answer')
        if (answer) answers.push({ quiz, key, ...plain(answer), recalls })
      }
    }
    return answers
  }

  /** Forget an answer, here and in every state that is merged with this one. */
  forget(quiz, key) {
    this.#read()
    this.#setAnswer(quiz, key, { ...NOTHING, gone: this.#tick() })
    this.#write()
  }

  /** Move an answer to another key, as the text of its question has changed. An answer that is already there stays. */
  rename(quiz, oldKey, newKey) {
    this.#read()
    const old = this.#state.answers.get(quiz)?.get(oldKey)
    const target = this.#state.answers.get(quiz)?.get(newKey) ?? NOTHING
    if (!old?.values.size || target.values.size || oldKey === newKey) return
    const withNewTick = (value) => ({ ...value, tick: this.#tick() })
    const values = new Map([...old.values].map(([name, value]) => [name, withNewTick(value)]))
    this.#setAnswer(quiz, newKey, { gone: target.gone, values, recalls: old.recalls.map(withNewTick) })
    this.#setAnswer(quiz, oldKey, { ...NOTHING, gone: this.#tick() })
    this.#write()
  }

  // --- lessons

  /**
   * Lessons by id. `marked`: it is recorded whether it is read; `at`: the time of the last change.
   * @returns {Map<string, {read: boolean, marked: boolean, place: {section: string, title: string, share: number, at: string} | null,
   *   at: string}>}
   */
  lessons() {
    const lessons = new Map()
    for (const [id, { values }] of this.#current.lessons) {
      const read = values.get('read')
      const place = values.get('place')
      const at = !read || (place && place.tick > read.tick) ? place?.at : read.at
      if (at) lessons.set(id, { read: read?.value ?? false, marked: read !== undefined, place: place ? plain(place) : null, at })
    }
    return lessons
  }

  /**
   * Record how far a lesson is read.
   * @param {string} id
   * @param {{anchor: string, title?: string, share: number}} place the anchor of a section (empty: the beginning), its title, and the
   *   share of the lesson that has been in sight, 0 to 1
   */
  readLesson(id, { anchor, title = '', share }) {
    const time = new Date(this.#now()).toISOString()
    this.#setLesson(id, 'place', placeOf({ section: anchor, title: title.slice(0, 300), share, at: time }))
  }

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
    let newest = null
    for (const [id, { values }] of this.#current.lessons) {
      const place = values.get('place')
      if (place && (newest === null || place.tick > newest.tick || (place.tick === newest.tick && id > newest.id))) {
        newest = { id, ...place }
      }
    }
    return newest && { id: newest.id, ...plain(newest) }
  }

  // --- the whole

  /** Call `fn({isLocal})` after each change, made by this page or in another tab. @returns {() => void} ends it */
  onChange(fn) {
    if (!this.#hasRead) this.#read()
    this.#listeners.add(fn)
    return () => this.#listeners.delete(fn)
  }

  /** Read the storage again: another tab may have changed it while this page got no events. */
  refresh() {
    const previous = this.#current
    this.#read()
    if (this.#text !== null && previous !== this.#state && encode(this.#state, this.#course) !== this.#text) this.#tryWrite()
    if (previous !== this.#state) this.#tell(false)
  }

  /** Why progress is not stored, or that the stored text is damaged: `closed`, `full`, `newer`, `damaged`; else `null`. */
  trouble() {
    if (!this.#hasRead) this.#read()
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
   * Replace the state by `make(state, tick)`; `tick()` returns new ticks. See exchange.js.
   * @returns {boolean} `false` if there is no room for it: then nothing is changed
   */
  replace(make) {
    this.#read()
    const [state, text, trouble] = [this.#state, this.#text, this.#trouble]
    this.#setState(make(state, () => this.#tick()))
    if (encode(this.#state, this.#course) !== text && !this.#tryWrite() && this.#trouble === 'full') {
      this.#setState(state)
      this.#trouble = trouble
      return false
    }
    this.#tell(true)
    return true
  }

  /** Forget everything, here and in other tabs. */
  reset() {
    this.#read()
    this.#setState({ ...emptyState(), reset: this.#tick() })
    this.#write()
  }

  /** The backup of a damaged text, or `null`. */
  damagedText() {
    return readChoice(`${this.#name}.damaged`, this.#storage)
  }

  dropDamaged() {
    writeChoice(`${this.#name}.damaged`, null, this.#storage)
  }

  // --- inner

  #tick(now = this.#now()) {
    this.#clock = Math.max(now, this.#clock + 1)
    return this.#clock
  }

  #setState(state) {
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

  /** Read the stored text, and merge it if it has changed. */
  #read() {
    this.#hasRead = true
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
    const previousText = this.#text
    this.#text = text
    if (text === null) {
      // The browser's storage was emptied: the state of this page must not come back.
      if (previousText !== null) this.#setState(emptyState())
      this.#isReadOnly = false
      this.#trouble = null
      return
    }
    const { state, trouble } = parseState(text, this.#course)
    this.#isReadOnly = trouble === 'newer' || (trouble === 'damaged' && !this.#backUpDamaged(text))
    this.#trouble = trouble
    if (state) this.#setState(merge(this.#state, state))
  }

  #backUpDamaged(text) {
    try {
      if (this.damagedText() !== text) this.#storage.setItem(`${this.#name}.damaged`, text)
      return true
    } catch {
      return false
    }
  }

  #write() {
    this.#tryWrite()
    this.#tell(true)
  }

  /** @returns {boolean} whether the state was stored */
  #tryWrite() {
    if (this.#isReadOnly || this.#trouble === 'closed') return false
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

  #tell(isLocal) {
    for (const fn of [...this.#listeners]) fn({ isLocal })
  }
}

const plain = ({ tick, id, ...value }) => value
