/** Makes elements without markup in strings or style attributes, as a strict content security policy demands. */

const SVG = 'http://www.w3.org/2000/svg'

/**
 * Make an element. Properties that start with `on` become listeners; `class`, `role`, `for` and names with a dash become attributes;
 * the rest become properties of the element.
 *
 * @param {string} tag
 * @param {Record<string, any>} [properties] undefined and null are left out
 * @param {...(Node | string | null)} children
 * @returns {any} the element, of the kind of its tag
 */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag)
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null) continue
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value)
    else if (name === 'class' || name === 'role' || name === 'for' || name.includes('-')) element.setAttribute(name, value)
    else element[name] = value
  }
  element.append(...children.filter((child) => child !== null && child !== undefined))
  return element
}

/** A button with a text; most look like a button, those of the kind `lab-text` like a text. */
export function textButton(text, onclick, kind = 'lab-button') {
  return h('button', { type: 'button', class: kind, onclick }, text)
}

/** A button with an icon, whose text is its label. */
export function iconButton(name, text, onclick) {
  return h('button', { type: 'button', class: 'lab-icon', title: text, 'aria-label': text, onclick }, icon(name))
}

/** Icons of the buttons: SVG paths in a square of 16. */
const ICONS = {
  play: 'M4 2.5v11l9-5.5z',
  pause: 'M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z',
  step: 'M3 2.5v11l7.5-5.5zM11 2.5h2v11h-2z',
  back: 'M13 2.5v11L5.5 8zM3 2.5h2v11H3z',
  next: 'M2 3v10l6-5zM8 3v10l6-5z',
  previous: 'M14 3v10L8 8zM8 3v10L2 8z',
  reset: 'M8 2.2a5.8 5.8 0 1 1-5.5 4h1.7a4.2 4.2 0 1 0 3.8-2.4v2.1L3.9 3 8 .2z',
  hand: 'M4.6 8V4a.9.9 0 0 1 1.8 0v3.2h.5V2.5a.9.9 0 0 1 1.8 0v4.7h.5V3.2a.9.9 0 0 1 1.8 0v4.4h.4V5.2a.9.9 0 0 1 1.8 0v5a4.5 4.5 0 0 1-4.5 4.5c-1.9 0-3-.9-4-2.5L2.5 9a.95.95 0 0 1 1.6-1z',
  full: 'M2 2h4.5v1.6H3.6v2.9H2zM9.500 2H14v4.500h-1.600V3.600H9.500zM2 9.500h1.600v2.900h2.900V14H2zM12.400 9.500H14V14H9.500v-1.600h2.900z',
}

/** An icon in the colour of the text. The button around it has the label. */
export function icon(name) {
  return pictogram(ICONS[name])
}

/** A picture of one path, in a square of 16, hidden from screen readers. */
export function pictogram(path) {
  const svg = outline(path)
  svg.setAttribute('viewBox', '0 0 16 16')
  return svg
}

/** An SVG of one path, without a size. */
export function outline(d) {
  const svg = draw('svg', { 'aria-hidden': 'true' })
  svg.append(draw('path', { d }))
  return svg
}

/** An element of an SVG; attributes that are empty are left out. @param {string} tag @param {Record<string, string | number>} [attributes] */
export function draw(tag, attributes = {}) {
  const element = document.createElementNS(SVG, tag)
  for (const [name, value] of Object.entries(attributes)) if (value !== '') element.setAttribute(name, String(value))
  return element
}

/** Call a listener of a field's input at most once per refresh of the screen; returns whether it is still to be called. */
export function onInput(field, act) {
  let isQueued = false
  field.addEventListener('input', () => {
    if (!isQueued) {
      requestAnimationFrame(() => {
        isQueued = false
        act()
      })
    }
    isQueued = true
  })
  return () => isQueued
}

let count = 0

/** A new id, for a reference to an element. */
export function freshId(prefix) {
  count += 1
  return `_${prefix}-${count}`
}

/** Let the reader download a text as a file. */
export function download(name, text, type = 'text/plain') {
  const address = URL.createObjectURL(new Blob([text], { type: `${type};charset=utf-8` }))
  const link = h('a', { href: address, download: name })
  document.body.append(link)
  link.click()
  link.remove()
  setTimeout(() => URL.revokeObjectURL(address), 10_000)
}

/** Whether the reader wants nothing to move by itself. */
export const prefersStillness = () => window.matchMedia('(prefers-reduced-motion: reduce)').matches
