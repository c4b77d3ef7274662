/** Small parts that all kinds of questions share. */

import { h, pictogram } from '../lab/page/dom.js'
import { fill } from '../page/words.js'

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

/** An icon in the colour of the text; words beside it say what it means. */
export function shape(name) {
  const svg = pictogram(SHAPES[name])
  svg.classList.add('quiz-shape')
  return svg
}

/** Show or hide an element; if it has the focus, hand it on to `next`. */
export function setHidden(element, hidden, next) {
  if (hidden && element.contains(document.activeElement)) next?.focus()
  element.hidden = hidden
}

/** A copy of an element's content, without ids. */
export function copyOf(element) {
  const copy = element.cloneNode(true)
  for (const child of copy.querySelectorAll('[id]')) child.removeAttribute('id')
  return copy.childNodes
}

/** The keys in a data attribute. */
export const keysIn = (text) => (text ?? '').split(' ').filter(Boolean)
