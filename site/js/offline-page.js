/**
 * The page on what is kept: says it, lets the reader choose, and names the page that could not be shown.
 *
 * Loaded by that page only. Without it the page says that nothing is kept here.
 */

import { FILES, groupsFor, isSparing, parseList } from './offline/list.js'
import { Store } from './offline/store.js'
import { begun, storeChoice, storedChoice, visit, workingRoot } from './page/offline.js'
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

/** Where another page was asked for, a way back to it; as soon as there is a network, by itself. */
function nameMissing(place) {
  const from = new URLSearchParams(location.search).get('from')
  if (!from) return
  const wanted = new URL(from, location.href)
  if (wanted.origin !== location.origin || !wanted.pathname.startsWith(root.pathname)) return
  const paragraph = document.createElement('p')
  paragraph.className = 'keep-missing'
  const address = document.createElement('span')
  address.className = 'keep-address'
  address.textContent = readable(wanted)
  const link = document.createElement('a')
  link.href = wanted.href
  link.textContent = words('offline.live.retry')
  paragraph.append(words('offline.live.missing'), ' ', address, ' ', link)
  place.before(paragraph)
  window.addEventListener('online', () => location.replace(wanted.href))
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

/** The list as the host has it, where nothing is kept and so no list. */
async function listOnly(place, store) {
  await offer(place, store)
  say(place, words('offline.live.never'))
}

/** Have the worker bring everything up to date, and say how far it is. */
async function keepUp(place, store, first = () => {}) {
  const keep = storedChoice(document)
  const worker = await begun(navigator, root)
  let offered = false
  const report = async ({ end, here, total, full, lost }) => {
    if (!offered && (end || (await store.lists()).length > 0)) {
      offered = true
      await first()
    }
    say(place, fill(!end ? 'busy' : full ? 'full' : lost ? 'lost' : 'done', { n: here, total }))
  }
  // One report after the other: the first ones have to wait for the store, and must not be said after the last.
  let reported = Promise.resolve()
  visit(window, worker, { keep, look: true }, (told) => {
    reported = reported.then(() => report(told)).catch(({ message }) => say(place, fill('failed', { message })))
  })
}

/** The choices, in the place of what the page says without a script. */
async function offer(place, store) {
  const list = await newestList(store)
  const chosen = storedChoice(document)
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
    button.checked = choice === (chosen === 'auto' ? automatic : chosen)
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
  const [kept] = storedChoice(document) === 'none' ? [] : await store.lists()
  if (kept) return kept.list
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
  // What is asked for is not to go when the browser needs room.
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
