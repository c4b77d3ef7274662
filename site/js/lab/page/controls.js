/** The controls of a lab: sliders, lists, buttons, and which overlays are drawn. */

import { freshId, h, onInput, textButton } from './dom.js'
import { digitsOfStep, formatNumber, formatReadout, withUnit } from './numbers.js'

const USUAL = 9 // characters of a value, for which there is room at first (lab-live.css)
const STEPS = 200 // of a slider without a step
const SIGNS = { momentum: 'p', angularMomentum: 'L', forces: 'F' }

/**
 * @param {any[]} controls of the lab's JSON
 * @param {{set?: (index: number, value: unknown) => void, press?: (index: number) => void}} actions of sliders and lists, and of buttons
 * @returns {{element: HTMLElement | null, show: (values: unknown[]) => void, setEnabled: (on: boolean) => void}}
 */
export function buildControls(controls, actions) {
  const parts = controls.map((control, i) => {
    if (control.type === 'slider') return slider(control, (value) => actions.set(i, value))
    if (control.type === 'select') return list(control, (value) => actions.set(i, value))
    return button(control, () => actions.press(i))
  })
  const buttons = parts.filter((_, i) => controls[i].type === 'button').map(({ element }) => element)
  const settings = parts.filter((_, i) => controls[i].type !== 'button').map(({ element }) => element)
  const element = parts.length === 0 ? null : h('div', { class: 'lab-controls' })
  if (buttons.length > 0) element.append(h('div', { class: 'lab-buttons' }, ...buttons))
  if (settings.length > 0) element.append(h('div', { class: 'lab-settings' }, ...settings))
  return {
    element,
    show: (values) => parts.forEach((part, i) => part.show?.(values[i])),
    setEnabled: (isEnabled) => parts.forEach(({ field }) => (field.disabled = !isEnabled)),
  }
}

function button({ label }, press) {
  const field = textButton(label, press)
  return { element: field, field }
}

function slider({ label, unit, min, max, step, digits }, set) {
  const id = freshId('slider')
  const places = digits ?? digitsOfStep(step)
  const text = (value) => withUnit(formatNumber(value, places).trim(), unit)
  const output = h('output', { class: 'lab-value', for: id })
  const field = h('input', { type: 'range', id })
  Object.assign(field, { min: String(min), max: String(max), step: String(step ?? (max - min) / STEPS) })
  // Reserve the width of the widest value, so that nothing moves while the slider does.
  output.style.minWidth = `${Math.max(text(min).length, text(max).length)}ch`
  const show = (now) => {
    field.value = String(now ?? min)
    output.textContent = now === null || now === undefined ? '–' : text(now)
    field.setAttribute('aria-valuetext', output.textContent)
  }
  field.addEventListener('input', () => show(Number(field.value)))
  const isQueued = onInput(field, () => set(Number(field.value)))
  const element = h('div', { class: 'lab-slider' }, h('label', { for: id }, label), output, field)
  return { element, field, show: (now) => isQueued() || show(now) }
}

function list({ label, unit, options }, set) {
  const id = freshId('list')
  const onchange = () => set(options[field.selectedIndex][1])
  const field = h('select', { id, onchange }, ...options.map(([text]) => h('option', {}, text)))
  const element = h('div', { class: 'lab-list' }, h('label', { for: id }, unit ? `${label} (${unit})` : label), field)
  const show = (value) => (field.selectedIndex = options.findIndex((option) => option[1] === value))
  return { element, field, show }
}

/** Buttons for the arrows that the motion has, labelled with their usual symbols, and checkboxes for the other overlays. */
export function buildOverlays({ toggles, overlays, arrows }, words, toggle) {
  const available = Object.keys(SIGNS).filter((name) => arrows?.[name])
  const rest = toggles.filter((name) => !available.includes(name))
  const ticks = rest.map((name) => {
    const onchange = ({ target }) => toggle(name, target.checked)
    const box = h('input', { type: 'checkbox', checked: overlays.includes(name), onchange })
    return h('label', { class: 'lab-check', 'data-overlay': name }, box, ` ${words(`overlay.${name}`)}`)
  })
  const buttons = available.map((name) => arrowButton(name, words, overlays, toggle))
  const group = (kind, parts) =>
    parts.length > 0 ? h('div', { class: kind, role: 'group', 'aria-label': words('lab.overlays') }, ...parts) : null
  return { arrows: group('lab-arrows', buttons), boxes: group('lab-overlays', ticks) }
}

function arrowButton(name, words, overlays, toggle) {
  const kind = `lab-icon lab-arrow lab-${name}`
  const button = switchButton(h('i', {}, SIGNS[name]), kind, words(`overlay.${name}`), overlays.includes(name), (isOn) => toggle(name, isOn))
  button.dataset.overlay = name
  return button
}

/** A small button that stays pressed. */
export function switchButton(sign, kind, text, isOn, toggle) {
  const button = h('button', { type: 'button', class: kind, title: text, 'aria-label': text, 'aria-pressed': isOn }, sign)
  button.addEventListener('click', () => {
    isOn = !isOn
    button.setAttribute('aria-pressed', isOn)
    toggle(isOn)
  })
  return button
}

/** The readouts: labels, and values whose space grows but never shrinks. */
export function buildReadouts(readouts) {
  if (readouts.length === 0) return { element: null, show: () => {} }
  const rows = readouts.map(({ label }) => ({ label, value: h('dd', {}, '–'), room: USUAL, text: '–' }))
  const element = h('dl', { class: 'lab-readouts' }, ...rows.map(({ label, value }) => h('div', {}, h('dt', {}, label), value)))
  const show = (values) => {
    rows.forEach((row, i) => {
      const text = formatReadout(values[i], readouts[i].digits)
      if (text === row.text) return
      row.text = text
      row.value.textContent = text
      if (text.length > row.room) {
        row.room = text.length
        row.value.style.minWidth = `min(100%, ${text.length}ch)`
      }
    })
  }
  return { element, show }
}
