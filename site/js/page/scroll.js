/**
 * Boxes that may scroll are keyboard stops in the page as built. If nothing in a box is cut off, the stop is removed; else
 * `data-more` says on which side there is more.
 */

import { selectAll } from './select.js'

/** The sides of a box on which something is hidden: `start`, `end`, `both`, or ''. */
function hiddenSides({ scrollLeft, clientWidth, scrollWidth }) {
  const position = Math.abs(scrollLeft) // negative where text runs from the right
  const hasBefore = position > 1
  const hasAfter = position + clientWidth < scrollWidth - 1
  return hasBefore && hasAfter ? 'both' : hasBefore ? 'start' : hasAfter ? 'end' : ''
}

export function markScrolling(part) {
  const mark = (box) => {
    const sides = hiddenSides(box)
    if (sides) box.dataset.more = sides
    else delete box.dataset.more
    const overflows = box.scrollHeight > box.clientHeight + 1 && getComputedStyle(box).overflowY !== 'hidden'
    if (sides || overflows) box.tabIndex = 0
    else box.removeAttribute('tabindex')
  }
  const observer = new ResizeObserver((entries) => entries.forEach(({ target }) => mark(target)))
  for (const box of selectAll(part, '[tabindex="0"]')) {
    observer.observe(box)
    box.addEventListener('scroll', () => mark(box), { passive: true })
  }
}
