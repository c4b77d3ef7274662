/** The pages about the reader's progress. A separate script, which only these pages load. */

import { showPage } from './progress/page.js'
import { showReview } from './progress/review.js'

const start = (document, parts) => (document.querySelector('[data-progress="review"]') ? showReview : showPage)(document, parts)

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: start }))
