/** Loads labs when they come near. A page without labs loads nothing. */

const NEAR = '600px 0px' // of the window's edge

/**
 * @param {Document} document
 * @param {(key: string) => string} words
 */
export function loadLabs(document, words) {
  const labs = [...document.querySelectorAll('[data-lab][data-config]')]
  if (labs.length === 0) return
  // A page opened from disk may load neither modules nor data: the recorded form stays.
  if (document.location.protocol === 'file:') return labs.forEach((lab) => tell(lab, words('lab.live.from_disk')))
  const start = (lab) => {
    near.unobserve(lab)
    // Relative to the page: a script that is no module would take its own address.
    import(new URL(lab.dataset.script, document.baseURI).href).then(
      ({ mountLab }) => mountLab(lab, words),
      () => tell(lab, words('lab.live.no_script')),
    )
  }
  const near = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach(({ target }) => start(target)),
    {
      rootMargin: NEAR,
    },
  )
  labs.forEach((lab) => near.observe(lab))
  const linked = new URLSearchParams(document.location.hash.slice(1)).get('lab')
  labs.find((lab) => lab.dataset.lab === linked)?.scrollIntoView()
}

function tell(lab, text) {
  const message = lab.ownerDocument.createElement('p')
  message.className = 'lab-message'
  message.textContent = text
  lab.querySelector('.lab-title').after(message)
}
