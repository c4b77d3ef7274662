/**
 * One visit to a lesson, as a platform sees it: SCORM 1.2 Run-Time Environment, sections 3.3 (the API) and 3.4 (the data model).
 *
 * Entry point: `beginSession(api)`. A call that the platform refuses is no reason to lose what follows: it is noted in `trouble`.
 *
 * - Points' limits and interactions are optional in the standard: a platform that lists none of them gets none.
 * - In `browse` and `review` nothing of the learner is recorded (3.4.4, `cmi.core.lesson_mode`).
 * - A status that was reached is never taken back: not by a question that came after it, nor by a wrong answer.
 * - `finish` counts once, however a page ends.
 */

import { interaction } from './answers.js'
import { shortText, timespan } from './formats.js'

const RANK = { passed: 3, completed: 2, incomplete: 1, failed: 1 }
const MOST = 250 // interactions of one visit: a script gone wild must not fill the platform

/**
 * @param {object} api the platform's
 * @param {{now?: () => number}} around the clock, ms
 * @returns {Session | null} `null` where the platform does not begin
 */
export function beginSession(api, { now = Date.now } = {}) {
  const session = new Session(api, now)
  return session.begin() ? session : null
}

class Session {
  #api
  #now
  #began
  #open = false
  #recorded = 0
  #count = 0
  /** What the platform knows of interactions and of points. */
  #known = { interactions: [], points: [] }
  #said = new Map()

  constructor(api, now) {
    this.#api = api
    this.#now = now
    this.#began = now()
    /** What the platform refused, first to last: the call and its error. */
    this.trouble = []
  }

  begin() {
    this.#open = this.#call('LMSInitialize', '') === 'true'
    if (!this.#open) return false
    this.records = !['browse', 'review'].includes(this.#get('cmi.core.lesson_mode'))
    this.learner = this.#get('cmi.core.student_id')
    this.kept = this.#get('cmi.suspend_data')
    this.location = this.#get('cmi.core.lesson_location')
    this.status = this.#get('cmi.core.lesson_status')
    this.#known = { interactions: this.#children('cmi.interactions'), points: this.#children('cmi.core.score') }
    if (this.#known.interactions.includes('id')) this.#count = Number.parseInt(this.#get('cmi.interactions._count'), 10) || 0
    if (this.records) {
      if (RANK[this.status] === undefined) this.#setStatus('incomplete')
      this.#commit()
    }
    return true
  }

  /** Record an answer. */
  answer(question, answer) {
    if (!this.#open || !this.records || this.#recorded >= MOST || !this.#known.interactions.includes('id')) return
    const at = `cmi.interactions.${this.#count}.`
    const elements = interaction(question, answer, new Date(this.#now())).filter(([name]) => this.#known.interactions.includes(name.split('.')[0]))
    this.#count += 1
    this.#recorded += 1
    for (const [name, value] of elements) this.#call('LMSSetValue', at + name, value)
  }

  /**
   * Record how the lesson stands.
   * @param {{raw: number | null, status: string}} grade
   * @param {string} kept for the next visit
   * @param {string} location where to go on
   */
  progress({ raw, status }, kept, location) {
    if (!this.#open || !this.records) return
    if (raw !== null) {
      if (this.#known.points.includes('min')) this.#set('cmi.core.score.min', '0')
      if (this.#known.points.includes('max')) this.#set('cmi.core.score.max', '100')
      this.#set('cmi.core.score.raw', String(raw))
    }
    if (RANK[status] > (RANK[this.status] ?? 0)) this.#setStatus(status)
    this.#set('cmi.suspend_data', kept)
    if (location.length <= 255) this.#set('cmi.core.lesson_location', shortText(location))
    this.#commit()
  }

  /** End the visit. */
  finish() {
    if (!this.#open) return
    if (this.records) {
      this.#set('cmi.core.session_time', timespan(this.#now() - this.#began))
      this.#set('cmi.core.exit', 'suspend') // so that what was kept is there on the next visit
      this.#commit()
    }
    this.#open = false
    this.#call('LMSFinish', '')
  }

  #setStatus(status) {
    this.status = status
    this.#set('cmi.core.lesson_status', status)
  }

  #children(name) {
    return this.#get(`${name}._children`).split(',').map((part) => part.trim())
  }

  #get(name) {
    return this.#call('LMSGetValue', name) ?? ''
  }

  /** Set what is not set so already. */
  #set(name, value) {
    if (this.#said.get(name) === value) return
    if (this.#call('LMSSetValue', name, value) === 'true') this.#said.set(name, value)
  }

  #commit() {
    this.#call('LMSCommit', '')
  }

  #call(name, ...given) {
    let answer
    try {
      answer = String(this.#api[name](...given) ?? '')
    } catch (error) {
      this.trouble.push({ call: [name, ...given], error: String(error) })
      return null
    }
    if (name !== 'LMSGetValue' && answer !== 'true') this.trouble.push({ call: [name, ...given], error: this.#lastError() })
    return answer
  }

  #lastError() {
    try {
      return String(this.#api.LMSGetLastError())
    } catch (error) {
      return String(error)
    }
  }
}
