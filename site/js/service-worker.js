/**
 * The site's service worker: keeps the course in the browser and shows it where there is no network.
 *
 * What it answers is decided in offline/answer.js, what it keeps in offline/update.js. It is the same text for every course. A page
 * tells it, by a message and once it has nothing else to do, that it was visited: that is when anything is fetched.
 */

import { answer, isOurs } from './offline/answer.js'
import { Files } from './offline/fetching.js'
import { pagesFor, pathOf } from './offline/list.js'
import { Store } from './offline/store.js'
import { update } from './offline/update.js'

const scope = self.registration.scope
const store = new Store(self.caches, scope)
const get = (...request) => self.fetch(...request)

/** Milliseconds for which the host is not asked for its list again. */
const FRESH = 60_000

const shownTo = new Map() // page → digest of the state that was kept and shown; the worker may forget it
let looked = -Infinity
let running = Promise.resolve()

self.addEventListener('install', () => self.skipWaiting())

self.addEventListener('activate', (event) => event.waitUntil(begin()))

async function begin() {
  await self.registration.navigationPreload?.enable()
  await store.removeOthers()
  await self.clients.claim()
}

self.addEventListener('fetch', (event) => {
  const { request, preloadResponse, resultingClientId } = event
  if (!isOurs(request, scope)) return
  const around = {
    store,
    fetch: get,
    preload: request.mode === 'navigate' ? preloadResponse : undefined,
    wait: (time) => new Promise((done) => setTimeout(done, time)),
    later: (work) => event.waitUntil(work),
    shown: (digest) => shownTo.set(resultingClientId, digest),
  }
  event.respondWith(answer(request, around))
})

self.addEventListener('message', (event) => {
  const { data, ports, source } = event
  if (data?.coursebuild !== 'visit' || !ports[0]) return
  // Whatever fails, the page must not wait for ever.
  const failed = () => ports[0].postMessage({ here: 0, total: 0, full: false, lost: true, end: true, bytes: null, now: '', shown: '' })
  running = running.then(() => visit(data, ports[0], source)).catch(failed)
  event.waitUntil(running)
})

async function visit({ pages, uses, keep, sparing, look }, port, source) {
  const own = pages.map((address) => pathOf(address, scope)).filter((path) => path !== null)
  const used = await needs(uses)
  const open = await self.clients.matchAll({ type: 'window', includeUncontrolled: true })
  const wish = {
    paths: [...own.flatMap(pagesFor), ...used],
    keep,
    sparing,
    look: look || Date.now() - looked > FRESH,
    alone: open.filter(({ url }) => url.startsWith(scope)).length <= 1,
  }
  const files = new Files(scope, get)
  const outcome = await update(store, files, wish, (here, total) => port.postMessage({ here, total }))
  if (wish.look && !outcome.lost) looked = Date.now()
  const [newest] = await store.lists()
  port.postMessage({
    ...outcome,
    end: true,
    bytes: newest?.list.bytes ?? null,
    now: own.flatMap(pagesFor).map((path) => newest?.list.files.get(path)).find(Boolean) ?? '',
    shown: shownTo.get(source?.id) ?? '',
  })
}

/** The paths of files that a page uses, and of those that its labs name: their engine comes to workers, of which pages do not know. */
async function needs(addresses) {
  const paths = new Set()
  const add = (address) => {
    const path = pathOf(address, scope)
    if (path !== null) paths.add(path)
    return path
  }
  for (const address of addresses) {
    if (!/^assets\/labs\/.*\.json$/.test(add(address) ?? '')) continue
    try {
      const config = await (await self.fetch(address)).json()
      for (const name of [config.module, config.mjb, config.worker, config.wasm]) {
        if (typeof name === 'string') add(new URL(name, address).href)
      }
    } catch {
      // Without a network there is nothing to be fetched now.
    }
  }
  return [...paths]
}
