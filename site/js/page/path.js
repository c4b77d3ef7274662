/** Leads a reader who began a path of the course along it: its steps, where the map has others, become *previous* and *next*. */

import { readChoice, writeChoice } from './choices.js'

export function followPath(document) {
  const key = `coursebuild.path.${document.documentElement.dataset.course}`
  document.addEventListener('click', ({ target }) => {
    const link = target.closest('a[data-path]')
    if (link) writeChoice(key, link.dataset.path)
  })
  const path = readChoice(key)
  for (const step of document.querySelectorAll('a[data-way]')) {
    if (step.dataset.path !== path) continue
    const other = step.parentElement.querySelector(`[rel="${step.dataset.way}"]`)
    if (other && step.hidden) other.hidden = true
    other?.removeAttribute('rel')
    step.hidden = false
    step.rel = step.dataset.way
  }
}
