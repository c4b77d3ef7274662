/**
 * The session of one visit with the platform: SCORM 1.2 Run-Time Environment, sections 3.3 (the API) and 3.4 (the data model).
 *
 * Entry point: `beginSession(api)`. A call that the platform refuses does not stop later ones; it is noted in `trouble`.
 *
 * - The limits of the points and interactions are optional in the standard: they are set only if the platform lists them.
 * - In the modes `browse` and `review` nothing is recorded (3.4.4, `cmi.core.lesson_mode`).
 * - A status that was reached is never withdrawn, neither by a new question nor by a wrong answer.
 * - `finish` counts once, however a page ends.
 */

import { interaction } from './answers.js'
import { shortText, timespan } from './formats.js'

const RANK = { passed: 3, completed: 2, incomplete: 1, failed: 1 }
const MOST = 250 // interactions of one visit, so that a runaway script cannot fill the platform

/**
 * @param {Record<string, any>} api the platform's
 * @param {{now?: () => number}} clock ms
 * @returns {Session | null} `null` if the platform refuses to begin
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
  #interactionCount = 0
  /** The elements of interactions and points that the platform supports. */
  #supported = { interactions: [], points: [] }
  #values = new Map()

  constructor(api, now) {
    this.#api = api
    this.#now = now
    this.#began = now()
    /** The calls that the platform refused, in their order, each with its error. */
    this.trouble = []
  }

  begin() {
    this.#open = this.#call('LMSInitialize', '') === 'true'
    if (!this.#open) return false
    this.records = !['browse', 'review'].includes(this.#get('cmi.core.lesson_mode'))
    this.learner = this.#get('cmi.core.student_id')
    this.suspendData = this.#get('cmi.suspend_data')
    this.location = this.#get('cmi.core.lesson_location')
    this.status = this.#get('cmi.core.lesson_status')
    this.#supported = { interactions: this.#children('cmi.interactions'), points: this.#children('cmi.core.score') }
    if (this.#supported.interactions.includes('id')) this.#interactionCount = Number.parseInt(this.#get('cmi.interactions._count'), 10) || 0
    if (this.records) {
      if (RANK[this.status] === undefined) this.#setStatus('incomplete')
      this.#commit()
    }
    return true
  }

  answer(question, answer) {
    if (!this.#open || !this.records || this.#recorded >= MOST || !this.#supported.interactions.includes('id')) return
    const prefix = `cmi.interactions.${this.#interactionCount}.`
    const elements = interaction(question, answer, new Date(this.#now())).filter(([name]) => this.#supported.interactions.includes(name.split('.')[0]))
    this.#interactionCount += 1
    this.#recorded += 1
    for (const [name, value] of elements) this.#call('LMSSetValue', prefix + name, value)
  }

  /**
   * Record the state of the lesson.
   * @param {{raw: number | null, status: string}} grade
   * @param {string} suspendData for the next visit
   * @param {string} location at which to resume
   */
  progress({ raw, status }, suspendData, location) {
    if (!this.#open || !this.records) return
    if (raw !== null) {
      if (this.#supported.points.includes('min')) this.#set('cmi.core.score.min', '0')
      if (this.#supported.points.includes('max')) this.#set('cmi.core.score.max', '100')
      this.#set('cmi.core.score.raw', String(raw))
    }
    if (RANK[status] > (RANK[this.status] ?? 0)) this.#setStatus(status)
    this.#set('cmi.suspend_data', suspendData)
    if (location.length <= 255) this.#set('cmi.core.lesson_location', shortText(location))
    this.#commit()
  }

  /** End the visit. */
  finish() {
    if (!this.#open) return
    if (this.records) {
      this.#set('cmi.core.session_time', timespan(this.#now() - this.#began))
      this.#set('cmi.core.exit', 'suspend') // so that the next visit gets the suspend data
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

  /** Set an element, unless it has this value already. */
  #set(name, value) {
    if (this.#values.get(name) === value) return
    if (this.#call('LMSSetValue', name, value) === 'true') this.#values.set(name, value)
  }

  #commit() {
    this.#call('LMSCommit', '')
  }

  #call(name, ...args) {
    let answer
    try {
      answer = String(this.#api[name](...args) ?? '')
    } catch (error) {
      this.trouble.push({ call: [name, ...args], error: String(error) })
      return null
    }
    if (name !== 'LMSGetValue' && answer !== 'true') this.trouble.push({ call: [name, ...args], error: this.#lastError() })
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
