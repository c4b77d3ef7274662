/** What a trial does with the controls of a lab, and how messages call it. */

/** Everything that a reader can do with one control of a fresh lab. */
export function* controlActs(controls) {
  for (const [i, control] of controls.entries()) {
    const entry = ['controls', i]
    if (control.type === 'button') {
      yield { entry, what: `button "${control.label}"`, act: (lab) => lab.press(i) }
    } else if (control.type === 'select') {
      for (const [label, value] of control.options) {
        yield { entry, what: `"${control.label}" at "${label}"`, act: (lab) => lab.setControl(i, value) }
      }
    } else {
      for (const [name, value] of [['minimum', control.min], ['maximum', control.max], ['value', control.value]]) {
        yield { entry, what: `"${control.label}" at its ${name} ${value}`, act: (lab) => lab.setControl(i, value) }
      }
    }
  }
}

/** How messages call claims after these acts. @param {(string | Record<string, number | string>)[]} after */
export function describe(after) {
  if (after.length === 0) return 'claims from the start'
  const steps = after.map((step) => {
    if (typeof step === 'string') return `"${step}"`
    return Object.entries(step).map(([label, value]) => `"${label}" at ${JSON.stringify(value)}`).join(', ')
  })
  const only = after.length === 1 && typeof after[0] !== 'string'
  return `claims ${only ? 'with' : 'after'} ${steps.join(', then ')}`
}

/** Press buttons and set controls, in order. */
export function act(lab, controls, after) {
  const index = (label) => {
    const i = controls.findIndex((control) => control.label === label)
    if (i < 0) throw new RangeError(`there is no control "${label}"`)
    return i
  }
  for (const step of after) {
    if (typeof step === 'string') lab.press(index(step))
    else for (const [label, value] of Object.entries(step)) lab.setControl(index(label), value)
  }
}
