/**
 * Labs without an engine in a page: loaded by site.js when one comes near.
 *
 *   mountLab(element, words, progress) → Promise<Desk | null>
 */

import { Desk } from './lab/page/desk.js'
import { mount } from './lab/page/mount.js'

/**
 * Put a live desk in place of a lab's static form.
 *
 * @param {HTMLElement} element
 * @param {(key: string) => string} texts of the interface
 * @param {Record<string, any> | null} progress where reached goals are kept, see progress/store.js
 */
export function mountLab(element, texts, progress = null) {
  return mount(element, texts, (config, _, words) => new Desk(element, config, words, progress))
}
