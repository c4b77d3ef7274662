/**
 * Loads labs when they come near. A page without labs loads nothing.
 *
 * The event `coursebuild:run` makes a lab load at once and do what its detail lists: labels of buttons, and values by label.
 */

import { h } from '../lab/page/dom.js'
import { unfold } from './unfold.js'
import { selectAll } from './select.js'

const NEAR = '600px 0px' // of the window's edge

const instruments = new WeakMap() // lab → a promise of its instrument

/**
 * @param {Document | Element} part of the page
 * @param {(key: string) => string} words
 * @param {Record<string, any>} progress see progress/store.js
 */
export function loadLabs(part, words, progress) {
  const labs = selectAll(part, '[data-lab][data-config]')
  if (labs.length === 0) return
  // A page opened from disk may load neither modules nor data, unless it has them in itself: the recorded form stays.
  const isLoaded = labs.every((lab) => lab.dataset.script?.startsWith('data:'))
  if (location.protocol === 'file:' && !isLoaded) return labs.forEach((lab) => addMessage(lab, words('lab.live.from_disk')))
  const start = (lab) => {
    observer.unobserve(lab)
    // Relative to the page: in a classic script, import() would resolve against the script's address.
    const module = instruments.has(lab) ? null : import(new URL(lab.dataset.script, document.baseURI).href)
    const reportFailure = () => addMessage(lab, words('lab.live.no_script'))
    if (module) instruments.set(lab, module.then(({ mountLab }) => mountLab(lab, words, progress), reportFailure))
    return instruments.get(lab)
  }
  const observer = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach(({ target }) => start(target)),
    { rootMargin: NEAR },
  )
  // The page's own files come first.
  const watch = () => labs.forEach((lab) => observer.observe(lab))
  if (document.readyState === 'complete') watch()
  else window.addEventListener('load', watch, { once: true })
  for (const lab of labs) {
    lab.addEventListener('coursebuild:run', async ({ detail }) => (await start(lab))?.run?.(detail))
  }
  if (part === document) window.addEventListener('hashchange', followState)
  const linkedId = linkedLab(location.hash)
  const shared = part === document ? labs.find((lab) => lab.dataset.lab === linkedId) : null
  if (!shared) return
  unfold(shared)
  shared.scrollIntoView()
}

/** The id of the lab whose state an address holds, or null. */
export const linkedLab = (hash) => new URLSearchParams(hash.slice(1)).get('lab')

/** Follow a link to a state on this page, which is read as the page is loaded. */
function followState() {
  if (linkedLab(location.hash) === null) return
  history.scrollRestoration = 'manual' // so that the lab is gone to
  location.reload()
}

/** End the labs in a part that was removed from the page. */
export function leaveLabs(part) {
  for (const lab of selectAll(part, '[data-lab]')) instruments.get(lab)?.then((instrument) => instrument?.dispose?.())
}

function addMessage(lab, text) {
  lab.querySelector('.lab-title').after(h('p', { class: 'lab-message' }, text))
}
