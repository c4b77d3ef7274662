/** Puts a live instrument in place of a lab's static form. */

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
    const keepPlace = holdPlace(element)
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

/**
 * Notes where in the window something below a lab is: what the reader points at, has focused, or has in the middle.
 *
 * @returns {() => void} scrolls it back there after the lab has changed its height: not every browser does, and none for a pointer
 */
function holdPlace(lab) {
  const { scrollY, innerWidth, innerHeight } = window
  const middle = scrollY > 0 ? document.elementFromPoint(innerWidth / 2, innerHeight / 2) : null
  const place = (element) => element.getBoundingClientRect()
  const isSeen = (element) => element && !element.contains(lab) && place(element).bottom > 0 && place(element).top < innerHeight
  const held = [[...document.querySelectorAll(':hover')].at(-1), document.activeElement, middle].find(isSeen)
  const isBelow = held && !lab.contains(held) && lab.compareDocumentPosition(held) & Node.DOCUMENT_POSITION_FOLLOWING
  if (!isBelow) return () => {}
  const { top } = place(held)
  return () => window.scrollBy({ top: place(held).top - top, behavior: 'instant' })
}

/** Move the keyboard focus from the static form, which is now hidden, into the instrument. */
function moveFocus(element) {
  if (!element.querySelector('.lab-static')?.contains(document.activeElement)) return
  element.querySelector('.lab-live :is(button, input, select, a[href], [tabindex])')?.focus({ preventScroll: true })
}
