/**
 * A lab of expressions or equations as its values: which curves, readouts and goal belong to the values of its controls.
 *
 *   const curves = new Curves(config)
 *   const run = curves.run([0.1])      for the values of the controls
 *   run.at(2)                          → the environment of the formulas there
 *   run.samples()                      → what the plots show
 *
 * The environment is an array: the variable of the axis, the states, the controls, and the definitions (`where`). No DOM.
 */

import { solve } from './ode.js'
import { link } from './program.js'
import { Goal } from './sampler.js'

const SAMPLES = 600

export class Curves {
  /** @param {Record<string, any>} config of the lab */
  constructor({ axis, states, controls, where, events, plots, readouts, goal }) {
    this.axis = axis
    this.count = states.length
    this.first = 1 + states.length // slot of the first control
    this.size = this.first + controls.length + where.length
    this.where = where.map(link)
    this.starts = states.map(({ start }) => link(start))
    this.rates = states.map(({ rate }) => link(rate))
    this.events = events.map(({ when, direction, set, stop }) => ({
      when: link(when),
      direction,
      set: set.map(([slot, value]) => [slot, link(value)]),
      stop: stop && link(stop),
    }))
    this.plots = plots.map(({ x, traces, field }) => ({
      x: x && link(x),
      traces: traces.map(({ value }) => link(value)),
      field,
    }))
    this.readouts = readouts.map(({ value }) => link(value))
    this.goal = goal && { hold: goal.hold, holds: link(goal.value) }
  }

  /** @param {number[]} values of the controls */
  run(values) {
    return new Run(this, values)
  }
}

/** What follows from the values of the controls. */
export class Run {
  /** @param {Curves} curves; @param {number[]} values */
  constructor(curves, values) {
    const { axis, first, count, size } = curves
    this.curves = curves
    this.env = new Float64Array(size)
    this.env.set(values, first)
    this.states = this.env.subarray(1, first)
    this.solution = count > 0 ? this.integrate() : null
    this.start = axis.min
    this.end = this.solution === null ? axis.max : this.solution.end
    this.failure = this.solution?.failure ?? null
  }

  integrate() {
    const { axis, starts, rates, events, first } = this.curves
    const { env, states } = this
    const put = (t, y) => {
      env[0] = t
      if (y !== states) states.set(y)
      this.define()
    }
    put(axis.min, states.fill(0))
    return solve({
      start: axis.min,
      end: axis.max,
      states: Float64Array.from(starts, (start) => start(env)),
      rates: (t, y, out) => {
        put(t, y)
        for (let i = 0; i < out.length; i++) out[i] = rates[i](env)
      },
      events: events.map(({ when, direction, set, stop }) => ({
        direction,
        when: (t, y) => {
          put(t, y)
          return when(env)
        },
        assign: (t, y) => {
          put(t, y)
          const values = set.map(([, value]) => value(env))
          set.forEach(([slot], i) => (y[slot - 1] = values[i]))
          put(t, y)
          return stop !== null && stop(env) > 0
        },
      })),
    })
  }

  /** Compute what `where` defines. */
  define() {
    const { where, size } = this.curves
    where.forEach((value, i) => (this.env[size - where.length + i] = value(this.env)))
  }

  /** The environment at a place of the axis; at an event, after it or `before` it. */
  at(x, before = false) {
    this.env[0] = x
    this.solution?.at(x, this.states, before)
    this.define()
    return this.env
  }

  readouts(x) {
    const env = this.at(x)
    return this.curves.readouts.map((value) => value(env))
  }

  /**
   * Sample everything at equal distances, and twice at each event. `reached` is where the goal is reached, or null; `held` for how
   * long its condition has held at each sample.
   *
   * @returns {{times: number[], states: number[][], plots: {x: number[], traces: number[][]}[], held: number[], reached: number | null}}
   */
  samples() {
    const { curves, start, end, solution } = this
    const { axis, plots, goal } = curves
    const step = (axis.max - axis.min) / SAMPLES
    const times = []
    const states = Array.from({ length: curves.count }, () => [])
    const data = plots.map(({ traces }) => ({ x: [], traces: traces.map(() => []) }))
    const status = goal && new Goal(goal)
    const held = []
    const take = (t, before) => {
      const env = this.at(t, before)
      times.push(t)
      states.forEach((column, i) => column.push(env[1 + i]))
      plots.forEach(({ x, traces }, i) => {
        data[i].x.push(x ? x(env) : t)
        traces.forEach((value, j) => data[i].traces[j].push(value(env)))
      })
      if (!goal) return
      status.look(goal.holds(env) > 0, t)
      held.push(status.held)
    }
    const jumps = solution?.events ?? []
    for (let i = 0, next = 0; i <= SAMPLES; i++) {
      const t = i === SAMPLES ? axis.max : start + i * step
      for (; next < jumps.length && jumps[next].t <= Math.min(t, end); next++) {
        take(jumps[next].t, true)
        take(jumps[next].t, false)
      }
      if (t > end) break
      if (times[times.length - 1] !== t) take(t, false)
    }
    if (times.length === 0 || times[times.length - 1] < end) take(end, false)
    return { times, states, plots: data, held, reached: status?.reached ?? null }
  }

  /** The direction of motion in the plane of a plot: `[dx, dy]` at a point, in the environment of a place of the axis. */
  direction(x, [slotX, slotY], pointX, pointY) {
    const env = this.at(x)
    env[slotX] = pointX
    env[slotY] = pointY
    this.define()
    return [this.curves.rates[slotX - 1](env), this.curves.rates[slotY - 1](env)]
  }
}
