/**
 * Keeps what a reader looks at where it is, whatever changes above it.
 *
 *   const keep = holdPlace()
 *   … change the page …
 *   keep()
 */

// What sticks to the window says nothing of where the text is.
const STICKY = 'nav, nav *, .dock-lab, .dock-lab *'
const SELECTOR = `main :is(p, h1, h2, h3, h4, li, pre, figure, table, dl, details, math):not(${STICKY})`

export function holdPlace() {
  const root = document.documentElement
  if (window.scrollY === 0) return () => {}
  const seen = inSight()
  // The browser does the like by itself, some of them, and at another moment.
  root.style.overflowAnchor = 'none'
  return () => {
    const still = seen.find(({ element }) => element.isConnected && element.checkVisibility())
    if (still) window.scrollBy({ top: still.element.getBoundingClientRect().top - still.top, behavior: 'instant' })
    requestAnimationFrame(() => root.style.removeProperty('overflow-anchor'))
  }
}

/** What begins in the window, from its top; then what reaches into it from above. */
function inSight() {
  const inside = []
  const above = []
  for (const element of document.querySelectorAll(SELECTOR)) {
    if (!element.checkVisibility()) continue // what is folded has no place
    const { top, bottom } = element.getBoundingClientRect()
    if (top >= 0 && top < window.innerHeight) inside.push({ element, top })
    else if (top < 0 && bottom > 0) above.unshift({ element, top })
  }
  return [...inside, ...above]
}
