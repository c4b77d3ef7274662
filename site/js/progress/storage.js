/** The keys under which progress is stored, and whether there is any: all that the head of a page needs. */

export const PREFIX = 'coursebuild.progress.'

/** Whether this browser stores progress of any course. */
export function hasProgress() {
  try {
    return Object.keys(localStorage).some((key) => key.startsWith(PREFIX))
  } catch {
    return false // storage is blocked
  }
}
