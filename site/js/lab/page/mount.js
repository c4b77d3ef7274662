/** Puts a live instrument in place of a lab's static form. */

import { holdPlace, inSight } from '../../page/place.js'
import { h } from './dom.js'
import { readLink } from './share.js'
import { fill } from '../../page/words.js'

/**
 * Put a live instrument in place of a lab's static form, which stays if the lab cannot run.
 *
 * @param {HTMLElement} element has `data-config`, the address of the lab's JSON
 * @param {(key: string) => string} texts of the interface
 * @param {(config: Record<string, any>, base: string, words: (key: string, values?: Record<string, any>) => string) => any} make
 *   makes the instrument, given the lab's JSON and the address to which its addresses are relative
 */
export async function mount(element, texts, make) {
  const words = (key, values) => fill(texts(key), values)
  try {
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

/** What the reader points at or has focused below a lab; else what is in sight there, if the lab begins above the window. @returns {Element[]} */
function lookedAt(lab) {
  const follows = (element) => !lab.contains(element) && Boolean(lab.compareDocumentPosition(element) & Node.DOCUMENT_POSITION_FOLLOWING)
  const isInSight = (element) => {
    const { top, bottom } = element.getBoundingClientRect()
    return bottom > 0 && top < window.innerHeight
  }
  const pointedAt = [...document.querySelectorAll(':hover')].slice(-1)
  const chosen = [...pointedAt, document.activeElement].filter((element) => element && follows(element) && isInSight(element))
  return chosen.length > 0 || lab.getBoundingClientRect().top >= 0 ? chosen : inSight().filter(follows)
}

/** Move the keyboard focus from the static form, which is now hidden, into the instrument. */
function moveFocus(element) {
  if (!element.querySelector('.lab-static')?.contains(document.activeElement)) return
  element.querySelector('.lab-live :is(button, input, select, a[href], [tabindex])')?.focus({ preventScroll: true })
}
