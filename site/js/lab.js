/**
 * Labs and exercises in a page: loaded by site.js when a lab comes near. docs/explanation/how-labs-run.md says how a page holds a lab.
 *
 *   mountLab(element, words, progress) → Promise<Instrument | null>
 */

import { Exercise } from './exercise/page.js'
import { mountCustom } from './lab/page/custom.js'
import { Instrument } from './lab/page/instrument.js'
import { mount } from './lab/page/mount.js'
import { Workbench, openEditor } from './lab/page/workbench.js'

/**
 * Put a live instrument in place of a lab's static form.
 *
 * @param {HTMLElement} element
 * @param {(key: string) => string} texts of the interface
 * @param {Record<string, any> | null} progress where reached goals and solved exercises are kept, see progress/store.js
 */
export function mountLab(element, texts, progress = null) {
  return mount(element, texts, (config, base, words) => {
    if (typeof WebAssembly !== 'object') throw new Error(words('lab.live.no_wasm'))
    const { exercise } = element.dataset
    if (exercise) return new Exercise(element, { ...config, exercise: JSON.parse(exercise) }, base, words, progress)
    const Kind = { simlab: Instrument, mjcf: Workbench }[config.kind ?? 'simlab']
    return Kind ? new Kind(element, config, base, words, progress, openEditor) : mountCustom(element, config, base, words)
  })
}
