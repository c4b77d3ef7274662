/** Opens what a link leads into: not each browser does, and a script that marks lines has to. */

const FOLD = 'details:not([open])'

/** Open each fold around an element. */
export function unfold(element) {
  for (let fold = element.closest(FOLD); fold; fold = fold.closest(FOLD)) fold.open = true
}

/** Open the folds around what the address names, or under its heading, now and when it changes. */
export function unfoldLinked(window) {
  const open = () => {
    const target = window.document.getElementById(decoded(window.location.hash.slice(1)))
    const text = target?.matches('.further > :first-child') ? target.nextElementSibling : target
    if (!text?.closest(FOLD)) return
    unfold(text)
    target.scrollIntoView()
  }
  open()
  window.addEventListener('hashchange', open)
}

/** What a part of an address says. */
export function decoded(text) {
  try {
    return decodeURIComponent(text)
  } catch {
    return text // a percent sign that begins no character
  }
}
