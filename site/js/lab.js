/**
 * Labs in a page: loaded by site.js when a lab comes near. docs/explanation/how-labs-run.md says how a page holds a lab.
 *
 *   mountLab(element, words, progress) → Promise<Instrument | null>
 */

import { h } from './lab/page/dom.js'
import { Instrument } from './lab/page/instrument.js'
import { mountCustom } from './lab/page/custom.js'
import { Workbench } from './lab/page/workbench.js'
import { readLink } from './lab/page/share.js'
import { missingFeature } from './lab/page/support.js'
import { fill } from './lab/page/words.js'

/**
 * Put a live instrument in place of a lab's static form, which stays if the lab cannot run.
 *
 * @param {HTMLElement} element has `data-config`, the address of the lab's JSON
 * @param {(key: string) => string} texts of the interface
 * @param {Record<string, any> | null} progress where reached goals are kept, see progress/store.js
 */
export async function mountLab(element, texts, progress = null) {
  const words = (key, values) => fill(texts(key), values)
  try {
    const lack = missingFeature()
    if (lack !== null) throw new Error(words(lack))
    const base = new URL(element.dataset.config, document.baseURI).href
    const response = await fetch(base)
    if (!response.ok) throw new Error(words('lab.live.not_found', { status: response.status }))
    const config = await response.json()
    const Kind = { simlab: Instrument, mjcf: Workbench }[config.kind ?? 'simlab']
    const instrument = await (Kind ? new Kind(element, config, base, words, progress) : mountCustom(element, config, base, words))
    moveFocus(element)
    const link = await readLink(window.location.hash)
    if (link?.id === config.id && link.state !== null) instrument.restore?.(link.state)
    return instrument
  } catch (error) {
    element.querySelector('.lab-title').after(h('p', { class: 'lab-message lab-is-wrong', role: 'alert' }, error.message))
    return null
  }
}

/** Move the keyboard focus from the static form, which is now hidden, into the instrument. */
function moveFocus(element) {
  if (!element.querySelector('.lab-static')?.contains(document.activeElement)) return
  element.querySelector('.lab-live :is(button, input, select, a[href], [tabindex])')?.focus({ preventScroll: true })
}
