/**
 * Real time, kept by whole timesteps.
 *
 * The clock owes the simulation the time that has passed, times the speed. `stepsDue` says how many whole steps that is;
 * `countSteps` subtracts those that were made. The timestep itself is never changed. At most `CATCH_UP` seconds are made up for,
 * so that a lab which was slow for a moment does not race afterwards; `ratio` says how far behind it runs.
 *
 * Pure: the caller brings the time, in seconds.
 */

const WINDOW = 1 // s of real time that `ratio` looks back on
const CATCH_UP = 0.1 // s of real time, the most that is made up for
const EPSILON = 1e-9 // of a step: rounding must not cost one

export class Clock {
  constructor() {
    this.speed = 1
    this.stop()
  }

  /** Forget the past: the next `stepsDue` starts a new count. */
  stop() {
    this.last = null
    this.debt = 0
    this.marks = []
    this.simulated = 0
    this.target = 0
  }

  /** Change how many simulated seconds go by in a real one. */
  setSpeed(speed) {
    if (!(speed > 0) || !Number.isFinite(speed)) throw new RangeError(`a speed of ${speed} is not possible`)
    this.speed = speed
    this.marks = []
    this.debt = Math.min(this.debt, CATCH_UP * speed)
  }

  /**
   * The whole steps that are due.
   *
   * @param {number} now s
   * @param {number} timestep s
   */
  stepsDue(now, timestep) {
    if (!(timestep > 0)) return 1 // the step itself will report the mistake
    if (this.last !== null && now > this.last) {
      const due = (now - this.last) * this.speed
      this.target += due
      // A step may be longer than `CATCH_UP`; it must become due all the same.
      this.debt = Math.min(this.debt + due, Math.max(CATCH_UP * this.speed, timestep))
    }
    this.last = now
    return Math.floor(this.debt / timestep + EPSILON)
  }

  /** Record that `steps` steps of `timestep` seconds were made; `now` as for `stepsDue`. */
  countSteps(steps, timestep, now) {
    this.debt = Math.max(0, this.debt - steps * timestep)
    this.simulated += steps * timestep
    // The remaining debt is late by less than a frame, which is no sign of slowness.
    this.marks.push({ now, reached: this.simulated + this.debt, target: this.target })
    while (this.marks.length > 2 && this.marks[1].now <= now - WINDOW) this.marks.shift()
  }

  /** Simulated time over the time that was due, in the last second: 1 is on time, 0.5 half as fast. */
  ratio() {
    if (this.marks.length < 2) return 1
    const first = this.marks[0]
    const last = this.marks[this.marks.length - 1]
    const target = last.target - first.target
    return target > 0 ? Math.min(1, (last.reached - first.reached) / target) : 1
  }

  /** Seconds of real time until the next step is due. */
  wait(timestep) {
    return Math.max(0, (timestep - this.debt) / this.speed)
  }
}
