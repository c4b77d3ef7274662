/** Opens the folds that a link leads into: not every browser does, and a script that marks lines has to. */

const FOLD = 'details:not([open])'
const HIDDEN = '[hidden="until-found"]'

/** Open each fold around an element, and show it if it is hidden until it is found, as a browser does that finds it. */
export function unfold(element) {
  const hidden = element.closest(HIDDEN)
  hidden?.dispatchEvent(new Event('beforematch'))
  hidden?.removeAttribute('hidden')
  for (let fold = element.closest(FOLD); fold; fold = fold.closest(FOLD)) fold.open = true
}

/** Open the folds around the target of the address, or under it if it is a heading, now and when the address changes. */
export function unfoldLinked(window) {
  const open = () => {
    const target = window.document.getElementById(decode(window.location.hash.slice(1)))
    const text = target?.matches('.further > :first-child') ? target.nextElementSibling : target
    if (!text?.closest(`${FOLD}, ${HIDDEN}`)) return
    unfold(text)
    target.scrollIntoView()
  }
  open()
  window.addEventListener('hashchange', open)
}

/** Decode a part of an address, if it is well formed. */
export function decode(text) {
  try {
    return decodeURIComponent(text)
  } catch {
    return text // a percent sign that begins no character
  }
}
