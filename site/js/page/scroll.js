/**
 * Boxes that may scroll can be reached by keyboard in the finished page. Where nothing is cut off there is nothing to
 * scroll, and the stop is taken away; where something is, `data-more` says on which side.
 */

import { within } from './within.js'

/** On which sides of a box there is more to see: `start`, `end`, `both`, or nothing. */
export function hiddenSides(scrollLeft, clientWidth, scrollWidth) {
  const position = Math.abs(scrollLeft) // negative where text runs from the right
  const before = position > 1
  const after = position + clientWidth < scrollWidth - 1
  return before && after ? 'both' : before ? 'start' : after ? 'end' : ''
}

export function markScrolling(part) {
  const mark = (box) => {
    const sides = hiddenSides(box.scrollLeft, box.clientWidth, box.scrollWidth)
    if (sides) box.dataset.more = sides
    else delete box.dataset.more
    const below = box.scrollHeight > box.clientHeight + 1 && getComputedStyle(box).overflowY !== 'hidden'
    if (sides || below) box.tabIndex = 0
    else box.removeAttribute('tabindex')
  }
  const observer = new ResizeObserver((entries) => entries.forEach(({ target }) => mark(target)))
  for (const box of within(part, '[tabindex="0"]')) {
    observer.observe(box)
    box.addEventListener('scroll', () => mark(box), { passive: true })
  }
}
