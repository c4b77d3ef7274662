/**
 * Exercises in a page, loaded like labs when one comes near (page/labs.js).
 *
 *   mountLab(element, words, progress) → Promise<Exercise | null>
 */

import { Exercise } from './exercise/page.js'
import { mount } from './lab/page/mount.js'
import { missingFeature } from './lab/page/support.js'

/**
 * Put an editor and a simulation in place of an exercise's static form.
 *
 * @param {HTMLElement} element
 * @param {(key: string) => string} texts of the interface
 * @param {Record<string, any> | null} progress where solved exercises are kept, see progress/store.js
 */
export function mountLab(element, texts, progress = null) {
  return mount(element, texts, missingFeature, (config, base, words) => {
    const exercise = JSON.parse(element.dataset.exercise)
    return new Exercise(element, { ...config, exercise }, base, words, progress)
  })
}
