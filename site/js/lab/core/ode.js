/**
 * Solves ordinary differential equations with events: Dormand and Prince's method of order 5(4), with its dense output.
 *
 *   const solution = solve(problem)
 *   solution.at(t, out)    the states at a time, where the solution is known
 *
 * An event is looked for in the dense output of each step, and found by bisection. Then states are assigned, and the integration
 * starts again from there, or it ends. No DOM.
 */

const TOLERANCE = 1e-10 // relative to the largest value that a state has had
const TINY = 1e-290
const MOST_STEPS = 20_000
const MOST_EVENTS = 500
const LOOKS = 12 // places in a step at which events are looked for
const CLOSER = 40 // halvings, in search of the first flight after an event
const NEARBY = 1e-7 // of the whole range: where it is seen to which side an event's quantity moves
const SHORTEST = 1e-14 // of the whole range

const A = [
  [],
  [1 / 5],
  [3 / 40, 9 / 40],
  [44 / 45, -56 / 15, 32 / 9],
  [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
  [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
  [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
const C = [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1]
const ERROR = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]
const DENSE = [
  -12715105075 / 11282082432, 0, 87487479700 / 32700410799, -10690763975 / 1880347072, 701980252875 / 199316789632,
  -1453857185 / 822651844, 69997945 / 29380423,
] // prettier-ignore

/** @typedef {{kind: 'value' | 'blowup' | 'steps' | 'events', t: number, index: number}} Failure `index`: of the state or event, or -1 */

/**
 * A system of equations.
 *
 * @typedef {object} Problem
 * @property {number} start
 * @property {number} end
 * @property {Float64Array} states at the start
 * @property {(t: number, states: Float64Array, out: Float64Array) => void} rates
 * @property {{direction: number, when: (t: number, states: Float64Array) => number,
 *   assign: (t: number, states: Float64Array) => boolean}[]} events `assign` changes the states, and says whether the run ends
 */

/** A solution: polynomials, one for each step. */
class Solution {
  constructor({ start, states }) {
    this.size = states.length
    this.start = this.end = start
    this.first = states.slice()
    this.steps = [] // {t, h, end, parts}
    /** @type {{t: number, index: number}[]} */
    this.events = []
    /** @type {Failure | null} */
    this.failure = null
    /** @type {Float64Array | null} the states after the event that has ended it */
    this.last = null
    this.cursor = 0
  }

  /** The states at a time; where an event has changed them, those after it, or `before` it. */
  at(t, out, before = false) {
    const { steps } = this
    if (steps.length === 0) return out.set(this.first)
    if (this.last !== null && !before && t >= this.end) return out.set(this.last)
    let i = Math.min(this.cursor, steps.length - 1)
    while (i > 0 && (before ? t <= steps[i].t : t < steps[i].t)) i -= 1
    while (i + 1 < steps.length && (before ? t > steps[i].end : t >= steps[i].end)) i += 1
    this.cursor = i
    interpolate(steps[i], t, out)
  }
}

function interpolate({ t: start, h, parts }, t, out) {
  const s = (t - start) / h
  const r = 1 - s
  const n = out.length
  for (let i = 0; i < n; i++) {
    out[i] = parts[i] + s * (parts[n + i] + r * (parts[2 * n + i] + s * (parts[3 * n + i] + r * parts[4 * n + i])))
  }
}

const firstWrong = (values) => values.findIndex((x) => !Number.isFinite(x))

/** @param {Problem} problem */
export function solve(problem) {
  const { start, end, rates, events } = problem
  const solution = new Solution(problem)
  const n = problem.states.length
  const shortest = SHORTEST * Math.max(end - start, Math.abs(start), Math.abs(end))
  const y = problem.states.slice()
  const next = new Float64Array(n)
  const k = Array.from({ length: 7 }, () => new Float64Array(n))
  const largest = new Float64Array(n)
  const watch = new Watch(events)
  const fail = (kind, t, index = -1) => Object.assign(solution, { failure: { kind, t, index } })
  let t = start
  let h = 0
  let wrong = firstWrong(y)
  if (wrong >= 0) return fail('value', t, wrong)
  const restart = () => {
    rates(t, y, k[0])
    h = Math.min(firstStep(y, k[0], end - start), end - t)
    return firstWrong(k[0])
  }
  wrong = restart()
  if (wrong >= 0) return fail('value', t, wrong)
  watch.restart(t, y)
  events.forEach(({ when }, index) => {
    if (when(t, y) === 0) watch.release(index, { t, y, rate: k[0], before: 0, range: end - start })
  })
  for (let tries = 0; t < end; tries++) {
    if (tries >= MOST_STEPS) return fail('steps', t)
    const last = t + h >= end - shortest
    if (last) h = end - t
    for (let s = 1; s < 7; s++) {
      for (let i = 0; i < n; i++) {
        let sum = 0
        for (let j = 0; j < s; j++) sum += A[s][j] * k[j][i]
        next[i] = y[i] + h * sum
      }
      rates(t + C[s] * h, next, k[s])
    }
    let size = 0
    for (let i = 0; i < n; i++) {
      let sum = 0
      for (let s = 0; s < 7; s++) sum += ERROR[s] * k[s][i]
      const scale = TOLERANCE * Math.max(largest[i], Math.abs(y[i]), Math.abs(next[i])) + TINY
      size += ((h * sum) / scale) ** 2
    }
    size = Math.sqrt(size / Math.max(n, 1))
    if (!(size <= 1)) {
      h *= Number.isFinite(size) ? Math.max(0.2, 0.9 * size ** -0.2) : 0.1
      if (h < shortest) {
        wrong = k.map(firstWrong).find((index) => index >= 0) ?? -1
        return fail(wrong >= 0 ? 'value' : 'blowup', t, wrong)
      }
      continue
    }
    const step = { t, h, end: last ? end : t + h, parts: polynomials(y, next, k, h) }
    const found = events.length > 0 ? watch.look(step) : null
    if (found?.again) return fail('events', t, found.index)
    solution.steps.push(step)
    if (found === null) {
      t = step.end
      y.set(next)
      k[0].set(k[6])
      h *= Math.min(5, 0.9 * Math.max(size, 1e-10) ** -0.2)
    } else {
      t = step.end = found.t
      interpolate(step, t, y)
    }
    for (let i = 0; i < n; i++) largest[i] = Math.max(largest[i], Math.abs(y[i]))
    solution.end = t
    if (found === null) continue
    if (solution.events.length >= MOST_EVENTS) return fail('events', t, found.index)
    solution.events.push({ t, index: found.index })
    const before = events[found.index].when(t, y)
    const ends = events[found.index].assign(t, y)
    wrong = firstWrong(y)
    if (wrong >= 0) return fail('value', t, wrong)
    if (ends) {
      solution.last = y
      return solution
    }
    wrong = restart()
    if (wrong >= 0) return fail('value', t, wrong)
    watch.restart(t, y)
    watch.release(found.index, { t, y, rate: k[0], before, range: end - start })
  }
  return solution
}

/** A step that changes the states by a small part of themselves, and is a small part of the range. */
function firstStep(y, rate, range) {
  let h = 1e-3 * range
  for (let i = 0; i < y.length; i++) {
    const speed = Math.abs(rate[i])
    if (y[i] !== 0 && speed > 0) h = Math.min(h, (0.01 * Math.abs(y[i])) / speed)
  }
  return Math.max(h, 1e-9 * range)
}

function polynomials(y, next, k, h) {
  const n = y.length
  const parts = new Float64Array(5 * n)
  for (let i = 0; i < n; i++) {
    const change = next[i] - y[i]
    const bend = h * k[0][i] - change
    let sum = 0
    for (let s = 0; s < 7; s++) sum += DENSE[s] * k[s][i]
    parts[i] = y[i]
    parts[n + i] = change
    parts[2 * n + i] = bend
    parts[3 * n + i] = change - h * k[6][i] - bend
    parts[4 * n + i] = h * sum
  }
  return parts
}

/** Looks for events. `sides` has the sign of each one's quantity when it was last not 0. */
class Watch {
  constructor(events) {
    this.events = events
    this.sides = events.map(() => 0)
    this.latest = -1 // the event that has just been, until its quantity has left 0
  }

  /** Begin anew. */
  restart(t, y) {
    this.latest = -1
    this.sides = this.events.map(({ when }) => Math.sign(when(t, y)))
    this.states = new Float64Array(y.length)
  }

  /**
   * Find the side of an event that has just been. Its quantity is 0 but for rounding, unless the event has changed it; then the side
   * is the one to which it moves. If it stays 0, as for a ball that is laid on the floor, the event may come again.
   */
  release(index, { t, y, rate, before, range }) {
    const { when, direction } = this.events[index]
    const delta = NEARBY * range
    const after = when(t, y)
    const change = when(t + delta, y.map((value, i) => value + delta * rate[i])) - after
    if (Math.abs(after) > 10 * Math.abs(before) + Math.abs(change)) return
    this.latest = index
    this.sides[index] = Math.sign(change) || -direction
  }

  value(i, step, t) {
    interpolate(step, t, this.states)
    return this.events[i].when(t, this.states)
  }

  /** Find the first event in a step. @returns {{index: number, t: number, again?: boolean} | null} */
  look(step) {
    const length = step.end - step.t
    for (let place = 1, from = step.t; place <= LOOKS; place++) {
      const to = place === LOOKS ? step.end : step.t + (length * place) / LOOKS
      let first = null
      for (let i = 0; i < this.events.length; i++) {
        const side = Math.sign(this.value(i, step, to))
        if (!(side * this.sides[i] < 0)) continue
        const { direction } = this.events[i]
        if (direction !== 0 && side !== direction) continue
        const t = this.locate(i, step, from, to, place === 1 && i === this.latest)
        if (t === null) return { index: i, t: step.t, again: true }
        if (first === null || t < first.t) first = { index: i, t }
      }
      if (first !== null) return first
      for (let i = 0; i < this.events.length; i++) this.sides[i] = Math.sign(this.value(i, step, to)) || this.sides[i]
      this.latest = -1
      from = to
    }
    return null
  }

  /** The time at which a quantity passes 0; null if it never leaves the 0 of the event before. */
  locate(i, step, from, to, fresh) {
    const side = this.sides[i]
    let [low, high] = [from, to]
    if (fresh) {
      let close = 0
      do low = from + (to - from) / 2 ** ++close
      while (close < CLOSER && Math.sign(this.value(i, step, low)) !== side)
      if (close === CLOSER) return null
    }
    for (let halvings = 0; halvings < 100; halvings++) {
      const middle = low + (high - low) / 2
      if (middle <= low || middle >= high) break
      if (Math.sign(this.value(i, step, middle)) === side) low = middle
      else high = middle
    }
    return high
  }
}
