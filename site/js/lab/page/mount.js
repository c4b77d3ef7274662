/** Puts a live instrument in place of a lab's static form. */

import { holdPlace } from '../../page/place.js'
import { h } from './dom.js'
import { readLink } from './share.js'
import { fill } from './words.js'

/**
 * Put a live instrument in place of a lab's static form, which stays if the lab cannot run.
 *
 * @param {HTMLElement} element has `data-config`, the address of the lab's JSON
 * @param {(key: string) => string} texts of the interface
 * @param {() => string | null} missing the key of what is said of a feature that the browser lacks
 * @param {(config: Record<string, any>, base: string, words: (key: string, values?: Record<string, any>) => string) => any} make
 *   makes the instrument, given the lab's JSON and the address to which its addresses are relative
 */
export async function mount(element, texts, missing, make) {
  const words = (key, values) => fill(texts(key), values)
  try {
    const lack = missing()
    if (lack !== null) throw new Error(words(lack))
    const base = new URL(element.dataset.config, document.baseURI).href
    const response = await fetch(base)
    if (!response.ok) throw new Error(words('lab.live.not_found', { status: response.status }))
    const config = await response.json()
    const keepPlace = holdPlace(lookedAt(element))
    const made = make(config, base, words)
    keepPlace()
    const instrument = await made
    moveFocus(element)
    const link = await readLink(window.location.hash)
    if (link?.id === config.id && link.state !== null) instrument.restore?.(link.state)
    return instrument
  } catch (error) {
    element.querySelector('.lab-title').after(h('p', { class: 'lab-message lab-is-wrong', role: 'alert' }, error.message))
    return null
  }
}

/** What the reader points at, has focused, or has in the middle of the window, if it is below a lab. @returns {Element[]} */
function lookedAt(lab) {
  const middle = document.elementFromPoint(window.innerWidth / 2, window.innerHeight / 2)
  const isSeen = (element) => {
    const { top, bottom } = element.getBoundingClientRect()
    return bottom > 0 && top < window.innerHeight && !element.contains(lab)
  }
  const [seen] = [...[...document.querySelectorAll(':hover')].slice(-1), document.activeElement, middle].filter((element) => element && isSeen(element))
  return seen && !lab.contains(seen) && lab.compareDocumentPosition(seen) & Node.DOCUMENT_POSITION_FOLLOWING ? [seen] : []
}

/** Move the keyboard focus from the static form, which is now hidden, into the instrument. */
function moveFocus(element) {
  if (!element.querySelector('.lab-static')?.contains(document.activeElement)) return
  element.querySelector('.lab-live :is(button, input, select, a[href], [tabindex])')?.focus({ preventScroll: true })
}
