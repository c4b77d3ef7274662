/** The keys under which progress is stored, and whether there is any: all that the head of a page needs. */

import { openStorage } from '../page/choices.js'

export const PREFIX = 'coursebuild.progress.'

/** Whether this browser stores progress of any course. */
export function hasProgress() {
  return Object.keys(openStorage() ?? {}).some((key) => key.startsWith(PREFIX))
}
