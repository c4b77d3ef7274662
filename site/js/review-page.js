/** The page of the review. A separate script, which only this page loads, beside that of quizzes. */

import { showReview } from './progress/review.js'

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showReview }))
