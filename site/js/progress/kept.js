/** Where a reader's progress is kept, and whether there is any: all that the head of a page needs to know of it. */

export const PREFIX = 'coursebuild.progress.'

/** Whether this browser keeps progress, of whichever course. */
export function hasProgress() {
  try {
    return Object.keys(localStorage).some((key) => key.startsWith(PREFIX))
  } catch {
    return false // storage is closed to the page
  }
}
