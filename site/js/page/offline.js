/**
 * Lets the service worker store the page for offline reading, once the page has nothing else to do.
 *
 * Entry point: `keepOffline(window, words)`. Not for a site opened from disk, nor in a preview, nor if the reader wants nothing
 * stored. If the host's page has changed since this one was loaded, a notice says so.
 */

import { h } from '../lab/page/dom.js'
import { isSparing } from '../offline/list.js'
import { readChoice, writeChoice } from './choices.js'

const WORKER = 'service-worker.js'
const CHOICES = ['auto', 'read', 'text', 'all', 'none']
const CALM = 1500 // ms after loading
const AWAY = 300_000 // ms out of sight, after which a page is checked again

const choiceKey = (document) => `coursebuild.offline.${document.documentElement.dataset.course}`

/** What the reader wants to store; `auto` if nothing was chosen, or storage is blocked. */
export function storedChoice(document) {
  const choice = readChoice(choiceKey(document))
  return CHOICES.includes(choice) ? choice : 'auto'
}

export const storeChoice = (document, choice) => writeChoice(choiceKey(document), choice)

/** The address of the site's root if a service worker may serve it, else `null`. */
export function workingRoot({ document, location, navigator, isSecureContext, self, top }) {
  const { root = '' } = document.documentElement.dataset
  if (!isSecureContext || !navigator.serviceWorker || !/^https?:$/.test(location.protocol)) return null
  if (top !== self) return null // in the frame of a learning platform, which decides itself what to store
  if (!document.querySelector('link[rel=manifest]')) return null // in the package of such a platform, which has no worker
  // The page for missing addresses names the root by the course's base address, at which this copy of the site may not be.
  if (root.startsWith('/') || document.querySelector('script[src^="/.coursebuild/"]')) return null
  return new URL(root || './', document.baseURI)
}

/**
 * Report a visit to the worker.
 *
 * @param {Window} window
 * @param {ServiceWorker} worker
 * @param {Record<string, any>} wish see `visit` in service-worker.js
 * @param {(progress: any) => void} tell reports progress, and with `end` the outcome
 */
export function visit({ location, navigator, performance }, worker, wish, tell) {
  const { port1, port2 } = new MessageChannel()
  port1.onmessage = ({ data }) => {
    if (data.end) port1.close()
    tell(data)
  }
  const message = {
    coursebuild: 'visit',
    pages: [location.href.split('#')[0]],
    uses: performance.getEntriesByType('resource').map(({ name }) => name),
    sparing: isSparing(navigator.connection),
    look: false,
    ...wish,
  }
  worker.postMessage(message, [port2])
}

/** The site's worker, registered and active. */
export async function activeWorker({ serviceWorker }, root) {
  const registration = await serviceWorker.register(new URL(WORKER, root), { scope: root.pathname }) // `ready` may be that of an outer course
  while (registration.active === null) {
    await new Promise((resolve) => (registration.installing ?? registration.waiting).addEventListener('statechange', resolve, { once: true }))
  }
  return registration.active
}

/**
 * @param {Window} window
 * @param {(key: string) => string} words
 */
export function keepOffline(window, words) {
  const { document, navigator } = window
  const root = workingRoot(window)
  // The page about offline reading visits the worker itself; see offline-page.js.
  if (!root || window.frameElement || document.querySelector('[data-keep]') || storedChoice(document) === 'none') return
  let version = null
  const check = async (force) => {
    const worker = await activeWorker(navigator, root)
    visit(window, worker, { keep: storedChoice(document), look: force }, ({ end, now, shown: storedVersion }) => {
      if (!end || !now) return
      version ??= storedVersion || now
      if (now !== version) offerReload(document, words)
    })
  }
  const start = () => setTimeout(() => check(false).catch(() => {}), CALM) // the browser may forbid it, and nothing depends on it
  if (document.readyState === 'complete') start()
  else window.addEventListener('load', start)
  const checkNow = () => check(true).catch(() => {})
  window.addEventListener('online', checkNow)
  let hidden = 0
  document.addEventListener('visibilitychange', () => {
    if (document.hidden) hidden = Date.now()
    else if (hidden && Date.now() - hidden > AWAY) checkNow()
  })
}

function offerReload(document, words) {
  if (document.querySelector('.notice')) return
  const notice = h('div', { class: 'notice', role: 'status' })
  document.body.append(notice) // a live region must exist before its text
  notice.append(words('offline.changed'), ' ', h('button', { type: 'button', onclick: () => location.reload() }, words('offline.again')))
}
