/** The script of every page. Pages are complete without it; it adds comfort. */

import { addCopyButtons, addEditButtons } from './page/copy.js'
import { followContents } from './page/contents.js'
import { followPredictions, gatePredictions } from './page/gates.js'
import { leaveLabs, loadLabs } from './page/labs.js'
import { keepOffline } from './page/offline.js'
import { addLineNumbers, followLines } from './page/lines.js'
import { placeNotes } from './page/notes.js'
import { followPath } from './page/path.js'
import { prepareForPrint } from './page/print.js'
import { markScrolling } from './page/scroll.js'
import { settle } from './page/settle.js'
import { leaveQuizzes, mountQuizzes } from './page/quizzes.js'
import { addSearch } from './page/search.js'
import { addThemeSwitch } from './page/theme.js'
import { unfoldLinked } from './page/unfold.js'
import { showVersions } from './page/versions.js'
import { readWords } from './page/words.js'
import { showProgress } from './progress/index.js'
import { rekeyAnswers } from './progress/match.js'
import { openProgress } from './progress/store.js'

let table = readWords(document)
const words = (key) => table(key)
const progress = openProgress(document.documentElement.dataset.course ?? '')

function improve(part) {
  addCopyButtons(part, words)
  addEditButtons(part, words)
  markScrolling(part)
  addLineNumbers(part, words) // after markScrolling: the numbers stay a keyboard stop
  loadLabs(part, words, progress)
  mountQuizzes(part, words, progress)
}

let leaves = []

/** Follow the reader on the page as it is now. */
function follow() {
  leaves.forEach((leave) => leave())
  leaves = [showProgress(document, words, progress, improve), followContents(document), placeNotes(document)]
}

addThemeSwitch(document, words)
addSearch(document, words)
rekeyAnswers(document, progress)
improve(document)
gatePredictions(document, words, progress)
followPredictions(document, progress)
follow()
prepareForPrint(window)
keepOffline(window, words)
followLines(window)
followPath(document)
unfoldLinked(window)
showVersions(document)
settle(window)

// In a preview, parts of the page are replaced while it is open.
document.addEventListener('coursebuild:changed', ({ detail: { added, removed } }) => {
  table = readWords(document)
  removed.forEach(leaveLabs)
  removed.forEach(leaveQuizzes)
  if (!document.querySelector('.theme')) addThemeSwitch(document, words)
  addSearch(document, words)
  added.forEach(improve)
  gatePredictions(document, words, progress)
  addLineNumbers(document, words) // for listings of which only some lines were replaced
  follow()
})
