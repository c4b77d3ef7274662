/** Copy buttons on code, added by script, since they need one to work. */

import { selectAll } from './select.js'

const SHOWN_FOR = 2000 // ms

/** The code of a listing: all its parts, folded ones too, without its output. */
export function codeOf(listing) {
  return [...listing.querySelectorAll('pre > code')].map((code) => code.textContent).join('')
}

/** Add a button to every element of a part of the page that has `data-copy`. */
export function addCopyButtons(part, words) {
  for (const target of selectAll(part, '[data-copy]')) {
    const listing = target.closest('.script, .code')
    const button = document.createElement('button')
    button.type = 'button'
    button.className = 'copy'
    button.textContent = words('code.copy')
    button.setAttribute('aria-live', 'polite')
    button.addEventListener('click', async () => {
      const isCopied = await copyText(codeOf(listing))
      button.textContent = words(isCopied ? 'code.copied' : 'code.failed')
      setTimeout(() => (button.textContent = words('code.copy')), SHOWN_FOR)
    })
    target.prepend(button)
  }
}

async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
