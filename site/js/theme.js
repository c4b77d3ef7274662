/** Sets the colours that the reader chose, before anything is drawn. Runs in the head of every page. */

import { applyTheme, storedTheme } from './page/theme.js'
import { hasProgress } from './progress/storage.js'

applyTheme(storedTheme())
// Reserve room for what scripts add from the start.
document.documentElement.classList.add('scripted')
if (hasProgress()) document.documentElement.classList.add('begun')
