/** Texts with values in them, and texts that depend on a number. */

import { fill } from '../lab/page/words.js'
import { form } from '../page/words.js'

/** `say(words, 'progress.map.lessons', { n: 3 })`: where a text has forms, `n` chooses. */
export function say(words, key, values = {}) {
  const text = words(key)
  if (text !== key || !('n' in values)) return fill(text, values)
  return fill(form(words, key, values.n), values)
}
