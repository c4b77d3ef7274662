/** Sets the colours that the reader chose, and fetches fonts, before anything is drawn. Runs in the head of every page, before its styles. */

import { applyTheme, storedTheme } from './page/theme.js'
import { hasProgress } from './progress/storage.js'

applyTheme(storedTheme())
// Reserve room for what scripts add from the start.
document.documentElement.classList.add('scripted')
if (hasProgress()) document.documentElement.classList.add('begun')
// From disk browsers load fonts for styles only.
if (location.protocol !== 'file:') fetchFonts(document.currentScript?.dataset.fonts ?? '')

/** Fetch fonts while the style sheet, which names them, is still on its way. @param {string} addresses with blanks between */
function fetchFonts(addresses) {
  for (const href of addresses.split(' ').filter(Boolean)) {
    const link = document.createElement('link')
    Object.assign(link, { rel: 'preload', as: 'font', type: 'font/woff2', crossOrigin: 'anonymous', href })
    document.head.append(link)
  }
}
