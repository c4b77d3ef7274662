/**
 * Opens the search: by a button in the page's head, Ctrl+K (or Cmd+K), and `/` unless the reader has switched that off.
 * Its script is loaded only then; the search page loads it at once.
 */

import { h } from '../lab/page/dom.js'
import { readChoice, writeChoice } from './choices.js'
import { loadOnce } from './scripts.js'

const KEY = 'coursebuild.shortcuts'

/** Whether shortcuts of a single key are on (WCAG 2.1.4). */
const singleKeys = () => readChoice(KEY) !== 'off'

const setSingleKeys = (isOn) => writeChoice(KEY, isOn ? null : 'off')

const FIELDS = 'input, textarea, select, [contenteditable]:not([contenteditable="false"]), .lab, dialog[open]'

/** Whether keys belong to something else: a text field, a simulation, another dialog. */
const isTaken = (target) => target?.closest?.(FIELDS) != null

/**
 * What a key means here: `open`, or nothing.
 * @param {Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey' | 'isComposing'>} event
 * @param {{ taken: boolean, single: boolean, mac: boolean }} place
 */
export function meaning({ key, ctrlKey, metaKey, altKey, isComposing }, { taken, single, mac }) {
  if (isComposing || altKey) return null
  // On a Mac, Ctrl+K in a field deletes the rest of the line.
  if (key.toLowerCase() === 'k' && ctrlKey !== metaKey) return mac && ctrlKey && taken ? null : 'open'
  return key === '/' && !ctrlKey && !metaKey && !taken && single ? 'open' : null
}

let listening = false

/**
 * Add the button, and on the first call listen for keys.
 * @param {Document} document
 * @param {(key: string) => string} words
 */
export function addSearch(document, words) {
  const tools = document.querySelector('[data-tools][data-search]')
  if (!tools || tools.querySelector('.search-open')) return
  const open = () => start(document, words, 'open')
  const attributes = { class: 'search-open', 'aria-haspopup': 'dialog', 'aria-keyshortcuts': 'Control+K' }
  tools.prepend(h('button', { type: 'button', ...attributes, onclick: open }, words('search.open')))
  if (document.querySelector('[data-search-form]')) start(document, words, 'mount')
  if (!listening) document.addEventListener('keydown', (event) => onKey(event, document, words))
  listening = true
}

function onKey(event, document, words) {
  const taken = isTaken(event.target)
  const mac = /^Mac|^iP/.test(navigator.platform)
  if (event.defaultPrevented || meaning(event, { taken, single: singleKeys(), mac }) !== 'open') return
  event.preventDefault()
  start(document, words, 'open')
}

async function start(document, words, action) {
  const { root = '', course = '' } = document.documentElement.dataset
  try {
    await loadOnce(document.querySelector('[data-search]').dataset.search)
    await globalThis.coursebuildSearch[action]({ root: new URL(root || './', document.baseURI).href, course, singleKeys, setSingleKeys })
  } catch {
    const button = document.querySelector('.search-open')
    button.textContent = words('search.failed')
    setTimeout(() => (button.textContent = words('search.open')), 4000)
  }
}
