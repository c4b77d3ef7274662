/** Copy buttons on code, added by script, since they need one to work. */

import { h } from '../lab/page/dom.js'
import { selectAll } from './select.js'

const SHOWN_FOR = 2000 // ms

/** The code of a listing: all its parts, folded ones too, without its output. */
function codeOf(listing) {
  return [...listing.querySelectorAll('pre > code')].map((code) => code.textContent).join('')
}

/** Add a button to every element of a part of the page that has `data-copy`. */
export function addCopyButtons(part, words) {
  for (const target of selectAll(part, '[data-copy]')) {
    const listing = target.closest('.script, .code')
    const copy = async () => {
      const isCopied = await copyText(codeOf(listing))
      button.textContent = words(isCopied ? 'code.copied' : 'code.failed')
      setTimeout(() => (button.textContent = words('code.copy')), SHOWN_FOR)
    }
    const button = h('button', { type: 'button', class: 'copy', 'aria-live': 'polite', onclick: copy }, words('code.copy'))
    target.prepend(button)
  }
}

/** Put a text into the clipboard; returns whether that is allowed. */
export const copyText = async (text) => {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return false
  }
}
