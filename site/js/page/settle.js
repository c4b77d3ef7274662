/** Lays out what css/prose.css leaves until it comes near, so that a jump to it finds the sizes that it has. */

const SPARE = 4 // ms that are left of an idle moment

/** Do so where nobody waits for it, and where a browser keeps the reader's place while what lies above it changes its size. */
export function settle({ document, CSS, requestIdleCallback }) {
  const parts = [...document.querySelectorAll('.prose > *')]
  const layOut = (moment) => {
    while (parts.length > 0 && moment.timeRemaining() > SPARE) {
      const part = parts.shift()
      part.style.setProperty('--below', 'visible')
      part.getBoundingClientRect()
    }
    if (parts.length > 0) requestIdleCallback(layOut)
  }
  if (requestIdleCallback && CSS.supports('overflow-anchor', 'auto')) requestIdleCallback(layOut)
}
