/** The interface's words, which the page carries in its `_words` template. */

/** @returns {(key: string) => string} the text of a key; the key itself where the page lacks it */
export function readWords(document) {
  const table = new Map()
  const template = document.getElementById('_words')
  for (const item of template ? template.content.querySelectorAll('[data-key]') : []) {
    table.set(item.dataset.key, item.textContent)
  }
  return (key) => table.get(key) ?? key
}

/**
 * The form of a text that goes with a number, in the language of the page: `form(words, 'progress.live.days', 3)` is the
 * text of `progress.live.days.few` where that language has such a form and the page carries it, else of `….other`.
 */
export function form(words, key, n, language = globalThis.document?.documentElement.lang) {
  const name = `${key}.${pluralRules(language).select(Math.abs(n))}`
  const text = words(name)
  return text === name ? words(`${key}.other`) : text
}

function pluralRules(language) {
  try {
    return new Intl.PluralRules(language || 'en')
  } catch {
    return new Intl.PluralRules('en') // no language tag that the browser can read
  }
}
