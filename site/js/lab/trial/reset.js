/** Checks whether a reset leads a lab back to its start, and if not, finds the code that prevents it. */

import { LabError, call } from '../core/piece.js'

/** Names in MjData of the parts of the state that have another name in mjtState. */
const FIELDS = { warmstart: 'qacc_warmstart', plugin: 'plugin_state' }

/**
 * Reset a lab and compare.
 *
 * The solver's warm start may differ: it is the last solution, which is exact only to the solver's tolerance.
 *
 * @param {import('../core/lab.js').Lab} lab
 * @param {Float64Array} start its state at the start
 * @returns {{what: string, entry: (string | number)[]} | null} the first number that differs, and the entry that should have set it
 */
export function resetDiffers(lab, start) {
  lab.reset()
  const state = lab.physics.read()
  const parts = partsOf(lab)
  const index = state.findIndex((x, i) => !Object.is(x, start[i]) && partAt(parts, i).name !== FIELDS.warmstart)
  if (index < 0) return null
  const { name, start: partStart, size } = partAt(parts, index)
  const number = name === 'time' && size === 1 ? name : `${name}[${index - partStart}]`
  return { what: number, entry: findCulprit(lab, index, start[index]) }
}

/** The parts of the state, in their order. */
function partsOf({ engine, model, physics }) {
  const parts = []
  let start = 0
  const bits = Object.entries(engine.k.state).filter(([, bit]) => (bit & (bit - 1)) === 0 && (physics.signature & bit) !== 0)
  for (const [key, bit] of bits.sort(([, a], [, b]) => a - b)) {
    const size = engine.mj.mj_stateSize(model, bit)
    const name = key.toLowerCase()
    parts.push({ name: FIELDS[name] ?? name, start, size })
    start += size
  }
  return parts
}

const partAt = (parts, i) => parts.find(({ start, size }) => i < start + size)

/** The entry that sets number `i` at the start but not after a reset, or else the entry that sets it after each reset. */
function findCulprit(lab, i, initial) {
  const { config, controls, code } = lab
  const number = () => lab.physics.read()[i]
  const writes = (action) => {
    const old = number()
    return succeeds(action) && !Object.is(number(), old)
  }
  const setters = config.controls.map((control, j) => ({ ...control, j })).filter(({ j, param }) => code.controls[j].set && param == null)
  for (const { j, init } of setters) {
    if (!init && writes(() => controls.apply(j)) && Object.is(number(), initial)) return ['controls', j]
  }
  lab.toKeyframe()
  if (code.setup && writes(() => call(['setup'], () => code.setup(lab.env)))) return ['setup']
  const last = setters.find(({ j, init }) => init && writes(() => controls.apply(j)))
  return last ? ['controls', last.j] : []
}

function succeeds(action) {
  try {
    action()
    return true
  } catch (error) {
    if (error instanceof LabError && error.kind !== 'engine') return false
    throw error
  }
}
