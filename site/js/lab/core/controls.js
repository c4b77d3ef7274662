/**
 * The controls of a lab: their values, and applying them.
 *
 * A parameter (`param`) is put into `ctx` before anything else runs, at the start and at every reset. A control with `init` is
 * applied after `setup`, each time. Every other one is applied once at the start, before `setup`, so that the model agrees with
 * the values on the page.
 */

import { call } from './piece.js'

export class Controls {
  /**
   * @param {Record<string, any>[]} data of the controls
   * @param {Record<string, any>[]} code of the same
   * @param {Record<string, any>} env what the code sees
   */
  constructor(data, code, env) {
    this.data = data
    this.code = code
    this.env = env
    this.values = data.map(initialValue)
  }

  /** Back to the values of the start, which the caller has to apply. */
  restart() {
    this.values = this.data.map(initialValue)
  }

  /** Apply the controls of a kind, or all, that have a value. @param {'param' | 'init' | 'once'} [kind] */
  applyAll(kind) {
    this.data.forEach((control, i) => {
      if (kind === undefined || kind === kindOf(control)) this.apply(i)
    })
  }

  apply(i) {
    const control = this.code[i]
    const value = this.values[i]
    if (control.set && value !== null) call(['controls', i], () => control.set(this.env, value))
  }

  /** Throw on what the page cannot have sent. No value means that a button was pressed. */
  check(i, value) {
    const control = this.data[i]
    const presses = value === undefined
    if (control === undefined || (control.type === 'button') !== presses) {
      throw new RangeError(`control ${i} ${presses ? 'is not a button' : 'takes no value'}`)
    }
    if (presses) return
    const fits =
      control.type === 'select'
        ? control.options.some((option) => option[1] === value)
        : Number.isFinite(value) && value >= (control.min ?? -Infinity) && value <= (control.max ?? Infinity)
    if (!fits) throw new RangeError(`the control "${control.label}" cannot be set to ${JSON.stringify(value)}`)
  }

  /** Take a new value, which is not yet applied. */
  take(i, value) {
    this.check(i, value)
    this.values[i] = value
  }

  /** Run the code of a button. */
  press(i) {
    this.check(i)
    call(['controls', i, 'run'], () => this.code[i].run(this.env))
  }
}

/** When a control is applied. */
function kindOf(control) {
  if (control.param != null) return 'param'
  return control.init ? 'init' : 'once'
}

/** The value with which a control starts; `null`: none until it is used. */
function initialValue(control) {
  if (control.type === 'button') return null
  if (control.type === 'select') return control.value ?? control.options[0][1]
  return control.value ?? null
}
