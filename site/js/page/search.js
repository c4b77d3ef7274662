/**
 * Opens the search: a button in the page's head, Ctrl+K (or Cmd+K), and `/` unless the reader has switched that off.
 * What the search needs is loaded then, and never with a page; the page of the search loads it at once.
 */

const KEY = 'coursebuild.shortcuts'

/** Whether single keys may do something (WCAG 2.1.4). */
export function singleKeys() {
  try {
    return localStorage.getItem(KEY) !== 'off'
  } catch {
    return true
  }
}

function setSingleKeys(on) {
  try {
    if (on) localStorage.removeItem(KEY)
    else localStorage.setItem(KEY, 'off')
  } catch {
    // Storage is closed: they stay on, as they are on every page.
  }
}

const FIELDS = 'input, textarea, select, [contenteditable]:not([contenteditable="false"]), .lab, dialog[open]'

/** Whether keys belong to something else: a field that is written in, a running simulation, another dialog. */
export const isTaken = (target) => target?.closest?.(FIELDS) != null

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

let loading = null

/** The search, loaded once; a load that failed is tried again. */
function load(document, script) {
  loading ??= new Promise((resolve, reject) => {
    const element = document.createElement('script')
    element.src = script
    element.onload = () => resolve(globalThis.coursebuildSearch)
    element.onerror = () => {
      element.remove()
      loading = null
      reject(new Error(script))
    }
    document.head.append(element)
  })
  return loading
}

let listening = false

/**
 * Add the button, and listen for keys from the first time on.
 * @param {Document} document
 * @param {(key: string) => string} words
 */
export function addSearch(document, words) {
  const tools = document.querySelector('[data-tools][data-search]')
  if (!tools || tools.querySelector('.search-open')) return
  const button = document.createElement('button')
  button.type = 'button'
  button.className = 'search-open'
  button.textContent = words('search.open')
  button.setAttribute('aria-haspopup', 'dialog')
  button.setAttribute('aria-keyshortcuts', 'Control+K')
  button.addEventListener('click', () => start(document, words, 'open'))
  tools.prepend(button)
  if (document.querySelector('[data-search-form]')) start(document, words, 'mount')
  if (!listening) document.addEventListener('keydown', (event) => pressed(event, document, words))
  listening = true
}

function pressed(event, document, words) {
  const taken = isTaken(event.target)
  const mac = /^Mac|^iP/.test(navigator.platform)
  if (event.defaultPrevented || meaning(event, { taken, single: singleKeys(), mac }) !== 'open') return
  event.preventDefault()
  start(document, words, 'open')
}

async function start(document, words, how) {
  const { root = '', course = '' } = document.documentElement.dataset
  try {
    const search = await load(document, document.querySelector('[data-search]').dataset.search)
    await search[how]({ root: new URL(root || './', document.baseURI).href, course, singleKeys, setSingleKeys })
  } catch {
    const button = document.querySelector('.search-open')
    button.textContent = words('search.failed')
    setTimeout(() => (button.textContent = words('search.open')), 4000)
  }
}
