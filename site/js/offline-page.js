/**
 * The page about offline reading: shows the state, lets the reader choose, and links to the page that could not be shown.
 *
 * Loaded by that page only. Without it the page says that nothing is stored.
 */

import { h } from './lab/page/dom.js'
import { FILES, groupsFor, isSparing, parseList } from './offline/list.js'
import { Store } from './offline/store.js'
import { activeWorker, storeChoice, storedChoice, visit, workingRoot } from './page/offline.js'
import { decode } from './page/unfold.js'
import { fill as fillIn, readWords } from './page/words.js'

const words = readWords(document)
const CHOICES = ['read', 'text', 'all', 'none']

const root = workingRoot(window)
const place = document.querySelector('[data-keep]')
if (root && place) {
  nameMissing(place)
  if (window.caches) begin(place).catch(({ message }) => say(place, fill('failed', { message })))
}

const fill = (key, values) => fillIn(words(`offline.live.${key}`), values)

/** Show the page that could not be shown, with a link to it; go there as soon as there is a network. */
function nameMissing(place) {
  const failedAddress = new URLSearchParams(location.search).get('from')
  if (!failedAddress) return
  const url = new URL(failedAddress, location.href)
  if (url.origin !== location.origin || !url.pathname.startsWith(root.pathname)) return
  const address = h('span', { class: 'keep-address' }, decode(url.pathname) + url.search)
  const link = h('a', { href: url.href }, words('offline.live.retry'))
  place.before(h('p', { class: 'keep-missing' }, words('offline.live.missing'), ' ', address, ' ', link))
  window.addEventListener('online', () => location.replace(url.href))
}

async function begin(place) {
  const store = new Store(window.caches, root.href)
  if (storedChoice(document) !== 'none') return keepUp(place, store, () => offer(place, store))
  await offer(place, store)
  say(place, words('offline.live.never'))
}

/** Let the worker update everything, and show its progress. */
async function keepUp(place, store, onList = () => {}) {
  const keep = storedChoice(document)
  const worker = await activeWorker(navigator, root)
  let offered = false
  const report = async ({ end, here: count, total, full, lost }) => {
    if (!offered && (end || (await store.lists()).length > 0)) {
      offered = true
      await onList()
    }
    say(place, fill(!end ? 'busy' : full ? 'full' : lost ? 'lost' : 'done', { n: count, total }))
  }
  // One report after the other: the first ones wait for the store, and must not be shown after the last.
  let lastReport = Promise.resolve()
  visit(window, worker, { keep, look: true }, (progress) => {
    lastReport = lastReport.then(() => report(progress)).catch(({ message }) => say(place, fill('failed', { message })))
  })
}

/** Replace the text of the page without scripts by the choices. */
async function offer(place, store) {
  const list = await newestList(store)
  const currentChoice = storedChoice(document)
  const automatic = list && groupsFor('auto', list, isSparing(navigator.connection)).includes('text') ? 'text' : 'read'
  const labels = CHOICES.map((choice) => {
    const checked = choice === (currentChoice === 'auto' ? automatic : currentChoice)
    const button = h('input', { type: 'radio', name: 'keep', value: choice, checked, onchange: () => choose(place, store, choice) })
    const size = list ? megabytes(groupsFor(choice, list, false).reduce((sum, name) => sum + list.bytes[name], 0)) : '…'
    return h('label', {}, button, h('span', {}, fill(choice, { size })))
  })
  place.replaceChildren(h('fieldset', {}, h('legend', {}, words('offline.live.legend')), ...labels), makeStatus())
}

async function newestList(store) {
  const [newest] = storedChoice(document) === 'none' ? [] : await store.lists()
  if (newest) return newest.list
  try {
    return parseList(await (await fetch(new URL(FILES, root))).text())
  } catch {
    return null
  }
}

async function choose(place, store, choice) {
  storeChoice(document, choice)
  if (choice === 'none') {
    const registration = await navigator.serviceWorker.getRegistration(root.href)
    await registration?.unregister()
    await store.remove()
    return say(place, words('offline.live.never'))
  }
  // Do not let the browser remove what the reader asked for.
  if (choice === 'all') await navigator.storage?.persist?.().catch(() => {})
  await keepUp(place, store)
}

function megabytes(bytes) {
  const number = new Intl.NumberFormat(document.documentElement.lang, { style: 'unit', unit: 'megabyte', maximumSignificantDigits: 2 })
  return number.format(Math.max(bytes / 1e6, 0.1)).replaceAll(' ', '\u00a0')
}

const makeStatus = () => h('p', { class: 'keep-status', role: 'status' })

function say(place, text) {
  let status = place.querySelector('.keep-status')
  if (!status) {
    status = makeStatus()
    place.append(status)
  }
  if (status.textContent !== text) status.textContent = text
}
