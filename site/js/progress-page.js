/** The page of the reader's progress. A separate script, which only this page loads. */

import { showPage } from './progress/page.js'

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showPage }))
