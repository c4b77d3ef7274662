/** Copy buttons on code. Without a script there are none, so that no button does nothing. */

import { within } from './within.js'

const SHOWN_FOR = 2000 // ms

/** The code of a listing: all its parts, folded ones too, but not what it printed. */
export function codeOf(listing) {
  return [...listing.querySelectorAll('pre > code')].map((code) => code.textContent).join('')
}

/** Add a button to every element of a part of the page that has `data-copy`. */
export function addCopyButtons(part, words) {
  for (const place of within(part, '[data-copy]')) {
    const listing = place.closest('.script, .code')
    const button = document.createElement('button')
    button.type = 'button'
    button.className = 'copy'
    button.textContent = words('code.copy')
    button.setAttribute('aria-live', 'polite')
    button.addEventListener('click', async () => {
      const done = await write(codeOf(listing))
      button.textContent = words(done ? 'code.copied' : 'code.failed')
      setTimeout(() => (button.textContent = words('code.copy')), SHOWN_FOR)
    })
    place.prepend(button)
  }
}

async function write(text) {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
