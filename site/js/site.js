/** Makes a finished page better: nothing on it depends on this script. */

import { addCopyButtons } from './page/copy.js'
import { followContents } from './page/contents.js'
import { loadLabs } from './page/labs.js'
import { openForPrint } from './page/print.js'
import { markScrolling } from './page/scroll.js'
import { addThemeSwitch } from './page/theme.js'
import { readWords } from './page/words.js'

const words = readWords(document)
addThemeSwitch(document, words)
addCopyButtons(document, words)
followContents(document)
markScrolling(document)
openForPrint(window)
loadLabs(document, words)
