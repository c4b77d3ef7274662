/** A lab's code, checked by a guard after each piece. */

import { curveEntry } from '../core/piece.js'

/** Ends a run once the guilty piece is known. */
class Found extends Error {}

/**
 * Wrap a lab's code so that it throws after the piece that changes what the guard protects.
 *
 * @param {Record<string, any>} code
 * @param {import('./guard.js').Guard} guard
 * @param {Record<string, any>} config the lab's JSON
 * @returns {{code: Record<string, any>, entry: () => (string | number)[] | null}} `entry` of that piece
 */
export function watchedCode(code, guard, config) {
  let guilty = null
  const look = (entry) => {
    if (guilty !== null || guard.changes().length === 0) return
    guilty = entry
    guard.repair()
    throw new Found()
  }
  const watch = (entry, run) => {
    if (!run) return run
    return (env, value) => {
      let result
      try {
        result = run(env, value)
      } catch (error) {
        look(entry)
        throw error
      }
      look(entry)
      return result
    }
  }
  const list = (name) => code[name].map((run, i) => watch([name, i, 'expr'], run))
  const wrappers = {
    setup: watch(['setup'], code.setup),
    controller: watch(['controller'], code.controller),
    controls: code.controls.map(({ set, run }, i) => ({ set: watch(['controls', i], set), run: watch(['controls', i, 'run'], run) })),
    readouts: list('readouts'),
    plots: code.plots.map((traces, i) => traces.map((run, j) => watch(curveEntry(config.plots[i], i, j), run))),
    expect: list('expect'),
    goal: watch(['goal', 'expr'], code.goal),
  }
  return { code: wrappers, entry: () => guilty }
}
