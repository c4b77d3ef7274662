/** The goal of a lab: a condition that has to stay true for a while. It is looked at where samples are taken. */

import { call, condition } from './piece.js'

const ENTRY = ['goal', 'expr']
const TOLERANCE = 1e-9 // s

export class Goal {
  /** @param {{hold: number}} data; @param {(env: object) => boolean} run its condition */
  constructor({ hold }, run) {
    this.hold = hold
    this.run = run
    this.clear()
  }

  /** A new run begins. */
  clear() {
    this.since = null // when it last became true
    this.held = 0 // s
    this.longest = 0
    this.reached = null // at which time
  }

  /** Look at data whose derived quantities are current. */
  look(env) {
    const { time } = env.data
    const holds = call(ENTRY, () => condition(ENTRY, this.run(env)))
    this.since = holds ? (this.since ?? time) : null
    this.held = holds ? time - this.since : 0
    this.longest = Math.max(this.longest, this.held)
    if (holds && this.held >= this.hold - TOLERANCE) this.reached ??= time
  }
}
