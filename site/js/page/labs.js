/** Loads labs when they come near. A page without labs loads nothing. */

import { within } from './within.js'

const NEAR = '600px 0px' // of the window's edge

const leave = new WeakMap() // lab → how to end what was begun for it

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
    const mounted = import(new URL(lab.dataset.script, document.baseURI).href).then(
      ({ mountLab }) => mountLab(lab, words, progress),
      () => tell(lab, words('lab.live.no_script')),
    )
    leave.set(lab, () => mounted.then((instrument) => instrument?.dispose?.()))
  }
  const near = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach(({ target }) => start(target)),
    {
      rootMargin: NEAR,
    },
  )
  for (const lab of labs) {
    leave.set(lab, () => near.unobserve(lab))
    near.observe(lab)
  }
  const linked = new URLSearchParams(location.hash.slice(1)).get('lab')
  if (part === document) labs.find((lab) => lab.dataset.lab === linked)?.scrollIntoView()
}

/** End what runs in a part that has gone from the page. */
export function leaveLabs(part) {
  for (const lab of within(part, '[data-lab]')) leave.get(lab)?.()
}

function tell(lab, text) {
  const message = lab.ownerDocument.createElement('p')
  message.className = 'lab-message'
  message.textContent = text
  lab.querySelector('.lab-title').after(message)
}
