/**
 * The site's service worker: stores the course in the browser and shows it without a network.
 *
 * offline/answer.js decides what it answers, offline/update.js what it stores. Its text is the same for every course. A page that
 * has nothing else to do sends it the message that it was visited; only then is anything fetched.
 */

import { answer, isOurs } from './offline/answer.js'
import { Files } from './offline/fetching.js'
import { pagesFor, pathOf } from './offline/list.js'
import { Store } from './offline/store.js'
import { update } from './offline/update.js'

const self = /** @type {any} */ (globalThis) // of a service worker
const scope = self.registration.scope
const store = new Store(self.caches, scope)
const get = (...request) => self.fetch(...request)

/** Milliseconds before the host is asked for its list again. */
const FRESH = 60_000

const storedVersions = new Map() // client id → digest of the stored page that was shown; lost when the browser stops the worker
let lastCheck = -Infinity
let running = Promise.resolve()

self.addEventListener('install', () => self.skipWaiting())

self.addEventListener('activate', (event) => event.waitUntil(activate()))

async function activate() {
  await self.registration.navigationPreload?.enable()
  await store.removeOthers()
  await self.clients.claim()
}

self.addEventListener('fetch', (event) => {
  const { request, preloadResponse, resultingClientId } = event
  if (!isOurs(request, scope)) return
  const services = {
    store,
    fetch: get,
    preload: request.mode === 'navigate' ? preloadResponse : undefined,
    wait: (time) => new Promise((resolve) => setTimeout(resolve, time)),
    waitUntil: (work) => event.waitUntil(work),
    onStored: (digest) => storedVersions.set(resultingClientId, digest),
  }
  event.respondWith(answer(request, services))
})

self.addEventListener('message', (event) => {
  const { data, ports, source } = event
  if (data?.coursebuild !== 'visit' || !ports[0]) return
  // Whatever fails, the page must get an end.
  const reportFailure = () => ports[0].postMessage({ here: 0, total: 0, full: false, lost: true, end: true, bytes: null, now: '', shown: '' })
  running = running.then(() => visit(data, ports[0], source)).catch(reportFailure)
  event.waitUntil(running)
})

async function visit({ pages, uses, keep, sparing, look }, port, source) {
  const ownPaths = pages.map((address) => pathOf(address, scope)).filter((path) => path !== null)
  const usedPaths = await pathsUsed(uses)
  const open = await self.clients.matchAll({ type: 'window', includeUncontrolled: true })
  const wish = {
    paths: [...ownPaths.flatMap(pagesFor), ...usedPaths],
    keep,
    sparing,
    look: look || Date.now() - lastCheck > FRESH,
    alone: open.filter(({ url }) => url.startsWith(scope)).length <= 1,
  }
  const files = new Files(scope, get)
  const outcome = await update(store, files, wish, (here, total) => port.postMessage({ here, total }))
  if (wish.look && !outcome.lost) lastCheck = Date.now()
  const [newest] = await store.lists()
  port.postMessage({
    ...outcome,
    end: true,
    bytes: newest?.list.bytes ?? null,
    now: ownPaths.flatMap(pagesFor).map((path) => newest?.list.files.get(path)).find(Boolean) ?? '',
    shown: storedVersions.get(source?.id) ?? '',
  })
}

/** The paths of the files that a page uses, and of those that its labs name, as the page does not see what workers fetch. */
async function pathsUsed(addresses) {
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
