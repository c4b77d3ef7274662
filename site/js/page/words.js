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
