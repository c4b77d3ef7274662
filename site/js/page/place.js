/**
 * Keeps what the reader looks at in its place on the screen when the page changes above it.
 *
 *   const keep = holdPlace()
 *   … change the page …
 *   keep()
 */

// Sticky elements do not show where the text is.
const STICKY = 'nav, nav *, .dock-lab, .dock-lab *'
const SELECTOR = `main :is(p, h1, h2, h3, h4, li, pre, figure, table, dl, details, math):not(${STICKY})`

/** @param {Element[]} elements that the reader may look at: the first that is still there then keeps its place */
export function holdPlace(elements = inSight()) {
  const root = document.documentElement
  if (window.scrollY === 0 || elements.length === 0) return () => {}
  const anchors = elements.map((element) => ({ element, top: element.getBoundingClientRect().top }))
  // Some browsers do the same by themselves, at another moment.
  root.style.overflowAnchor = 'none'
  return () => {
    const anchor = anchors.find(({ element }) => element.isConnected && element.checkVisibility())
    if (anchor) window.scrollBy({ top: anchor.element.getBoundingClientRect().top - anchor.top, behavior: 'instant' })
    requestAnimationFrame(() => root.style.removeProperty('overflow-anchor'))
  }
}

/** The elements that begin in the window, from its top; then those that reach into it from above. */
export function inSight() {
  const inside = []
  const overlapping = []
  for (const element of document.querySelectorAll(SELECTOR)) {
    if (!element.checkVisibility()) continue // folded away
    const { top, bottom } = element.getBoundingClientRect()
    if (top >= 0 && top < window.innerHeight) inside.push(element)
    else if (top < 0 && bottom > 0) overlapping.unshift(element)
  }
  return [...inside, ...overlapping]
}
