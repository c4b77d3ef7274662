/**
 * Calls the pieces of a lab's code, so that a failure is reported with its entry in the lesson.
 */

const LONGEST = 300 // characters of a message, which code may make as long as it likes

/**
 * A piece of lab code failed. `entry` is the way to it in the lab's JSON: ['controls', 2, 'set'].
 * `kind`: 'throws' | 'type' | 'nan' | 'engine' (the engine ended and will not work any more).
 */
export class LabError extends Error {
  constructor(kind, entry, message) {
    super(message.length > LONGEST ? `${message.slice(0, LONGEST)}…` : message)
    this.name = 'LabError'
    this.kind = kind
    this.entry = entry
  }
}

/**
 * The entry whose code runs now, and the entry that is being tried; still known after the engine was stopped from outside. `after` is called
 * with each entry once its code has run.
 *
 * @type {{entry: any, trying: any, after: (entry: (string | number)[]) => void}}
 */
export const current = { entry: null, trying: null, after: () => {} }

/** Call `code` for `entry`; what it throws becomes a LabError. */
export function call(entry, code) {
  const outer = current.entry
  current.entry = entry
  try {
    return code()
  } catch (error) {
    if (error instanceof LabError) throw error
    const kind = error instanceof WebAssembly.RuntimeError ? 'engine' : 'throws'
    throw new LabError(kind, entry, error instanceof Error ? `${error.name}: ${error.message}` : String(error))
  } finally {
    current.entry = outer
    current.after(entry)
  }
}

/** The entry of what a plot computes: of a trace or, behind them, of its horizontal axis. */
export const curveEntry = ({ traces }, i, j) => ['plots', i, ...(j < traces.length ? ['traces', j, 'expr'] : ['x'])]

/** Check a value for a readout: a number or a text, or `null` for none. */
export function readable(entry, value) {
  if (typeof value === 'number' || typeof value === 'string' || value === null) return value
  throw new LabError('type', entry, `gives ${describe(value)}, not a number or a text`)
}

/** Check a value for a plot: a number, or `null` for a gap. */
export function plottable(entry, value) {
  return value === null ? value : numeric(entry, value)
}

/** Check a value for a claim: a number, which may be NaN. */
export function numeric(entry, value) {
  if (typeof value === 'number') return value
  throw new LabError('type', entry, `gives ${describe(value)}, not a number`)
}

/** Check a value for a goal: true or false. */
export function condition(entry, value) {
  if (typeof value === 'boolean') return value
  throw new LabError('type', entry, `gives ${describe(value)}, not true or false`)
}

function describe(value) {
  if (value === null || value === undefined) return String(value)
  if (typeof value === 'string') return `the text ${JSON.stringify(value)}`
  if (typeof value !== 'object') return typeof value === 'function' ? 'a function' : `${typeof value} ${value}`
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return `an array of ${/** @type {any} */ (value).length}`
  return 'an object'
}
