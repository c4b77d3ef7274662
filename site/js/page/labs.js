/**
 * Loads labs when they come near. A page without labs loads nothing.
 *
 * The event `coursebuild:run` has a lab load at once, and do what the event's detail lists: labels of buttons, and values by label.
 */

import { unfold } from './unfold.js'
import { within } from './within.js'

const NEAR = '600px 0px' // of the window's edge

const mounted = new WeakMap() // lab → a promise of its instrument

/**
 * @param {Document | Element} part of the page
 * @param {(key: string) => string} words
 * @param {object} progress see progress/store.js
 */
export function loadLabs(part, words, progress) {
  const labs = within(part, '[data-lab][data-config]')
  if (labs.length === 0) return
  // A page opened from disk may load neither modules nor data: the recorded form stays.
  if (location.protocol === 'file:') return labs.forEach((lab) => tell(lab, words('lab.live.from_disk')))
  const start = (lab) => {
    near.unobserve(lab)
    // Relative to the page: a script that is no module would take its own address.
    const module = mounted.has(lab) ? null : import(new URL(lab.dataset.script, document.baseURI).href)
    const told = () => tell(lab, words('lab.live.no_script'))
    if (module) mounted.set(lab, module.then(({ mountLab }) => mountLab(lab, words, progress), told))
    return mounted.get(lab)
  }
  const near = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach(({ target }) => start(target)),
    {
      rootMargin: NEAR,
    },
  )
  // What the page itself shows comes first.
  const watch = () => labs.forEach((lab) => near.observe(lab))
  if (document.readyState === 'complete') watch()
  else window.addEventListener('load', watch, { once: true })
  for (const lab of labs) {
    lab.addEventListener('coursebuild:run', async ({ detail }) => (await start(lab))?.run?.(detail))
  }
  const linked = linkedLab(location.hash)
  const shared = part === document ? labs.find((lab) => lab.dataset.lab === linked) : null
  if (!shared) return
  unfold(shared)
  shared.scrollIntoView()
}

/** The lab whose state an address holds; null where it holds none. */
export const linkedLab = (hash) => new URLSearchParams(hash.slice(1)).get('lab')

/** End what runs in a part that has gone from the page. */
export function leaveLabs(part) {
  for (const lab of within(part, '[data-lab]')) mounted.get(lab)?.then((instrument) => instrument?.dispose?.())
}

function tell(lab, text) {
  const message = lab.ownerDocument.createElement('p')
  message.className = 'lab-message'
  message.textContent = text
  lab.querySelector('.lab-title').after(message)
}
