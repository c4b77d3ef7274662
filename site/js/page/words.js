/** The texts of the interface, which are in the page's `_words` template: their values, and their plural forms. */

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

/** `say(words, 'progress.map.lessons', { n: 3 })`: `n` chooses the form of a text that has several. */
export function say(words, key, values = {}) {
  const text = words(key)
  if (text !== key || !('n' in values)) return fill(text, values)
  return fill(form(words, key, values.n), values)
}

/** Puts values into interface texts: `fill('diverged at t = {t} s', { t: '1.20' })`. A name without a value stays. */
export function fill(text, values = {}) {
  const words = text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole))
  return FROM_THE_RIGHT.test(text) ? words.replace(QUANTITY, '\u2066$&\u2069') : words
}

const FROM_THE_RIGHT = /[\p{Script=Arabic}\p{Script=Hebrew}]/u

/** Numbers with a sign or a unit, which would stand on the wrong side of them in text from the right; with a unit before a Latin word they do not. */
const QUANTITY = /(?<![\w.,]|[A-Za-z] *= *)(?:[-+−±]\d[\d.,]*(?:[ \u00a0]?[A-Za-zµΩ°%][\w/²³·]*)?|\d[\d.,]*[ \u00a0]?[A-Za-zµΩ°%][\w/²³·]*(?![\w/²³·]|[ \u00a0][A-Za-z]))/g
