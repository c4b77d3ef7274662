/** Makes a finished page better: nothing on it depends on this script. */

import { addCopyButtons } from './page/copy.js'
import { followContents } from './page/contents.js'
import { leaveLabs, loadLabs } from './page/labs.js'
import { openForPrint } from './page/print.js'
import { markScrolling } from './page/scroll.js'
import { addThemeSwitch } from './page/theme.js'
import { readWords } from './page/words.js'

let table = readWords(document)
const words = (key) => table(key)

function improve(part) {
  addCopyButtons(part, words)
  markScrolling(part)
  loadLabs(part, words)
}

addThemeSwitch(document, words)
improve(document)
let leaveContents = followContents(document)
openForPrint(window)

// In a preview, parts of the page are replaced while it is open.
document.addEventListener('coursebuild:changed', ({ detail: { added, removed } }) => {
  table = readWords(document)
  removed.forEach(leaveLabs)
  if (!document.querySelector('.theme')) addThemeSwitch(document, words)
  added.forEach(improve)
  leaveContents()
  leaveContents = followContents(document)
})
