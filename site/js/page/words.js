/** The texts of the interface, which are in the page's `_words` template. */

/** @returns {(key: string) => string} the text of a key, or the key itself if the page lacks it */
export function readWords(document) {
  const table = new Map()
  const template = document.getElementById('_words')
  for (const item of template ? template.content.querySelectorAll('[data-key]') : []) {
    table.set(item.dataset.key, item.textContent)
  }
  return (key) => table.get(key) ?? key
}

/**
 * The plural form of a text for a number, in the language of the page: `form(words, 'progress.live.days', 3)` is the
 * text of `progress.live.days.few` if the language has that form and the page has the text, else of `….other`.
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
    return new Intl.PluralRules('en') // a language tag that the browser does not understand
  }
}
