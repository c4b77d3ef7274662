/** Fills interface texts with values, and chooses plural forms. */

import { fill } from '../lab/page/words.js'
import { form } from '../page/words.js'

/** `say(words, 'progress.map.lessons', { n: 3 })`: `n` chooses the form of a text that has several. */
export function say(words, key, values = {}) {
  const text = words(key)
  if (text !== key || !('n' in values)) return fill(text, values)
  return fill(form(words, key, values.n), values)
}
