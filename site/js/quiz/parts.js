/** Small things that all kinds of questions are made of. */

import { h, pictogram } from '../lab/page/dom.js'
import { fill } from '../lab/page/words.js'

export { fill, h }

const SHAPES = {
  right: 'M2.500 8.500 6.500 12.500 13.500 3.500',
  wrong: 'M3.500 3.500 12.500 12.500M12.500 3.500 3.500 12.500',
  partly: 'M3 8h10',
  unread: 'M5.200 5.400a2.800 2.800 0 1 1 4.100 2.600c-.9.5-1.300 1-1.300 2M8 12.600v.9',
  done: 'M3 4.500h10M3 8h10M3 11.500h6',
  up: 'M3.500 10 8 5.500 12.500 10',
  down: 'M3.500 6 8 10.500 12.500 6',
  grip: 'M6 4v.01M10 4v.01M6 8v.01M10 8v.01M6 12v.01M10 12v.01',
}

/** A small drawing in the colour of the text; what it means is said in words beside it. */
export function shape(name) {
  const svg = pictogram(SHAPES[name])
  svg.classList.add('quiz-shape')
  return svg
}

export function button(text, properties = {}) {
  return h('button', { type: 'button', class: 'quiz-button', ...properties }, text)
}

/** Show or hide an element that can be focused; one that has the focus hands it on. */
export function setHidden(element, hidden, next) {
  if (hidden && element.contains(document.activeElement)) next?.focus()
  element.hidden = hidden
}

/** A copy of what is in an element, without its ids. */
export function copyOf(element) {
  const copy = element.cloneNode(true)
  for (const one of copy.querySelectorAll('[id]')) one.removeAttribute('id')
  return copy.childNodes
}

/** The text of an element as it is read: without the source of its formulas. */
export function spoken(element) {
  const copy = element.cloneNode(true)
  for (const source of copy.querySelectorAll('annotation, annotation-xml')) source.remove()
  return copy.textContent.replace(/\s+/g, ' ').trim()
}

/** The keys in a data attribute. */
export const keysIn = (text) => (text ?? '').split(' ').filter(Boolean)
