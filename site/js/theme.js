/** Sets the colours that the reader chose, before anything is drawn. Runs in the head of every page. */

import { applyTheme, storedTheme } from './page/theme.js'

applyTheme(storedTheme())
document.documentElement.classList.add('scripted') // room for what scripts add is kept from the start
