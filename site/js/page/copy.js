/** Buttons on code that copy it or open it in an editor, added by script, since they need one to work. */

import { h } from '../lab/page/dom.js'
import { writeLink } from '../lab/page/share.js'
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

/** Add a button to each listing of MJCF that has an editor, the lab to which `data-editor` leads; `data-around` names elements around a part. */
export function addEditButtons(part, words) {
  if (location.protocol === 'file:') return // labs do not run there
  for (const tools of selectAll(part, '[data-editor]')) {
    const { editor, around } = tools.dataset
    const open = async () => {
      const address = new URL(editor, document.baseURI)
      const names = around.split(' ').filter(Boolean)
      const line = (tags) => tags.map((tag) => `<${tag}>`).join('')
      const lines = [line(names), codeOf(tools.closest('.script')).trimEnd(), line(names.map((name) => `/${name}`).reverse())]
      const text = lines.filter(Boolean).join('\n')
      const state = { values: [], steps: 0, time: 0, physics: new Float64Array(), text, isOther: true }
      const { link } = await writeLink(decodeURIComponent(address.hash.slice(1)), state)
      const { href } = new URL(link, address)
      const isHere = href === location.href
      location.assign(href)
      if (isHere) window.dispatchEvent(new Event('hashchange')) // which an address that stays does not bring
    }
    tools.prepend(h('button', { type: 'button', class: 'copy', onclick: open }, words('lab.live.edit')))
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
