/**
 * The page about offline reading: shows the state, lets the reader choose, and links to the page that could not be shown.
 *
 * Loaded by that page only. Without it the page says that nothing is stored.
 */

import { FILES, groupsFor, isSparing, parseList } from './offline/list.js'
import { Store } from './offline/store.js'
import { activeWorker, storeChoice, storedChoice, visit, workingRoot } from './page/offline.js'
import { readWords } from './page/words.js'

const words = readWords(document)
const CHOICES = ['read', 'text', 'all', 'none']
const SIZES = { text: ['shell', 'text'], all: ['shell', 'text', 'rest'] }

const root = workingRoot(window)
const place = document.querySelector('[data-keep]')
if (root && place) {
  nameMissing(place)
  if (window.caches) begin(place).catch(({ message }) => say(place, fill('failed', { message })))
}

function fill(key, values) {
  return words(`offline.live.${key}`).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole)
}

/** Show the page that could not be shown, with a link to it; go there as soon as there is a network. */
function nameMissing(place) {
  const failedAddress = new URLSearchParams(location.search).get('from')
  if (!failedAddress) return
  const url = new URL(failedAddress, location.href)
  if (url.origin !== location.origin || !url.pathname.startsWith(root.pathname)) return
  const paragraph = document.createElement('p')
  paragraph.className = 'keep-missing'
  const address = document.createElement('span')
  address.className = 'keep-address'
  address.textContent = readable(url)
  const link = document.createElement('a')
  link.href = url.href
  link.textContent = words('offline.live.retry')
  paragraph.append(words('offline.live.missing'), ' ', address, ' ', link)
  place.before(paragraph)
  window.addEventListener('online', () => location.replace(url.href))
}

function readable({ pathname, search }) {
  try {
    return decodeURIComponent(pathname) + search
  } catch {
    return pathname + search
  }
}

async function begin(place) {
  const store = new Store(window.caches, root.href)
  if (storedChoice(document) !== 'none') await keepUp(place, store, () => offer(place, store))
  else await listOnly(place, store)
}

/** Offer the choices while nothing is stored. */
async function listOnly(place, store) {
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
  const group = document.createElement('fieldset')
  const legend = document.createElement('legend')
  legend.textContent = words('offline.live.legend')
  group.append(legend)
  for (const choice of CHOICES) {
    const label = document.createElement('label')
    const button = document.createElement('input')
    button.type = 'radio'
    button.name = 'keep'
    button.value = choice
    button.checked = choice === (currentChoice === 'auto' ? automatic : currentChoice)
    button.addEventListener('change', () => choose(place, store, choice))
    const size = list ? megabytes((SIZES[choice] ?? []).reduce((sum, name) => sum + list.bytes[name], 0)) : '…'
    const text = document.createElement('span')
    text.textContent = fill(choice, { size })
    label.append(button, text)
    group.append(label)
  }
  const status = document.createElement('p')
  status.className = 'keep-status'
  status.setAttribute('role', 'status')
  place.replaceChildren(group, status)
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

function say(place, text) {
  let status = place.querySelector('.keep-status')
  if (!status) {
    status = document.createElement('p')
    status.className = 'keep-status'
    status.setAttribute('role', 'status')
    place.append(status)
  }
  if (status.textContent !== text) status.textContent = text
}
