/**
 * The pages about the reader's progress. A script of its own, which only these pages load.
 *
 * site.js hands over what the page has anyhow: the interface's words, the progress, and what brings questions to life.
 */

import { showPage } from './progress/page.js'
import { showReview } from './progress/review.js'

const start = (document, parts) => {
  if (document.querySelector('[data-progress="overall"]')) return showPage(document, parts)
  if (document.querySelector('[data-progress="review"]')) return showReview(document, parts)
  return () => {}
}

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: start }))
