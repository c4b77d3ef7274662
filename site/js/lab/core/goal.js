/** The goal of a lab: a condition that has to stay true for a while. It is evaluated whenever a sample is taken. */

import { call, condition } from './piece.js'

const ENTRY = ['goal', 'expr']
const TOLERANCE = 1e-9 // s

export class Goal {
  /** @param {{hold: number}} data; @param {(env: Record<string, any>) => boolean} run its condition */
  constructor({ hold }, run) {
    this.hold = hold
    this.run = run
    this.clear()
  }

  /** Begin a new run. */
  clear() {
    this.since = null // the time at which it last became true
    this.held = 0 // s, for which it has been true
    this.longest = 0 // s, the maximum of `held`
    this.reached = null // the time at which it had been true for long enough
  }

  /** How it stands. */
  read() {
    const { since, held, longest, reached } = this
    return { since, held, longest, reached }
  }

  /** Go to how it stood. */
  write(status) {
    Object.assign(this, status)
  }

  /** Evaluate it on data whose derived quantities are current. */
  look(env) {
    const { time } = env.data
    const holds = call(ENTRY, () => condition(ENTRY, this.run(env)))
    this.since = holds ? (this.since ?? time) : null
    this.held = holds ? time - this.since : 0
    this.longest = Math.max(this.longest, this.held)
    if (holds && this.held >= this.hold - TOLERANCE) this.reached ??= time
  }
}
