/** Whether a reset leads a lab back to where it started, and what keeps it from that. */

import { LabError, call } from '../core/piece.js'

/** Parts of the state whose names in MjData are not theirs here. */
const FIELDS = { warmstart: 'qacc_warmstart', plugin: 'plugin_state' }

/**
 * Reset a lab and compare.
 *
 * The solver's warm start may differ: it holds what was computed before, to the solver's tolerance.
 *
 * @param {import('../core/lab.js').Lab} lab
 * @param {Float64Array} before its state at the start
 * @returns {{what: string, entry: (string | number)[]} | null} the first number that differs, and the entry that would have to set it
 */
export function resetDiffers(lab, before) {
  lab.reset()
  const after = lab.physics.read()
  const parts = partsOf(lab)
  const first = after.findIndex((x, i) => !Object.is(x, before[i]) && partAt(parts, i).name !== FIELDS.warmstart)
  if (first < 0) return null
  const { name, start, size } = partAt(parts, first)
  const what = name === 'time' && size === 1 ? name : `${name}[${first - start}]`
  return { what, entry: culprit(lab, first, before[first]) }
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

/** The entry that sets number `i` at the start and not after a reset, or else the one that sets it after each. */
function culprit(lab, i, wanted) {
  const { config, controls, code } = lab
  const number = () => lab.physics.read()[i]
  const writes = (action) => {
    const old = number()
    return quietly(action) && !Object.is(number(), old)
  }
  const setters = config.controls.map((control, j) => ({ ...control, j })).filter(({ j, param }) => code.controls[j].set && param == null)
  for (const { j, init } of setters) {
    if (!init && writes(() => controls.apply(j)) && Object.is(number(), wanted)) return ['controls', j]
  }
  lab.toKeyframe()
  if (code.setup && writes(() => call(['setup'], () => code.setup(lab.env)))) return ['setup']
  const last = setters.find(({ j, init }) => init && writes(() => controls.apply(j)))
  return last ? ['controls', last.j] : []
}

function quietly(action) {
  try {
    action()
    return true
  } catch (error) {
    if (error instanceof LabError && error.kind !== 'engine') return false
    throw error
  }
}
