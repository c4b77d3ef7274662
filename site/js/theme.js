/** Sets the colours that the reader chose, before anything is drawn. Runs in the head of every page. */

import { applyTheme, storedTheme } from './page/theme.js'
import { hasProgress } from './progress/kept.js'

applyTheme(storedTheme())
// Room for what scripts add is kept from the start.
document.documentElement.classList.add('scripted')
if (hasProgress()) document.documentElement.classList.add('begun')
