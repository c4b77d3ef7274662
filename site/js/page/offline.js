/**
 * Has the page kept for times without a network, once it has nothing else to do.
 *
 * Entry point: `keepOffline(window, words)`. Not from disk, where all is there already, nor in a preview, nor where the reader wants
 * nothing kept. When the page on the host has become another one since this one was loaded, a line says so.
 */

import { isSparing } from '../offline/list.js'

const WORKER = 'service-worker.js'
const CHOICES = ['auto', 'read', 'text', 'all', 'none']
const CALM = 1500 // ms after loading
const AWAY = 300_000 // ms out of sight, after which a page is looked at again

const choiceKey = (document) => `coursebuild.offline.${document.documentElement.dataset.course}`

/** What the reader wants to be kept; `auto` where nothing was chosen, or storage is closed. */
export function storedChoice(document) {
  try {
    const choice = localStorage.getItem(choiceKey(document))
    return CHOICES.includes(choice) ? choice : 'auto'
  } catch {
    return 'auto'
  }
}

export function storeChoice(document, choice) {
  try {
    localStorage.setItem(choiceKey(document), choice)
  } catch {
    // Storage is closed: the choice holds for this page.
  }
}

/** The address of the site's root, where a service worker may serve it; else `null`. */
export function workingRoot({ document, location, navigator, isSecureContext, self, top }) {
  const root = document.documentElement.dataset.root
  if (!isSecureContext || !navigator.serviceWorker || !/^https?:$/.test(location.protocol)) return null
  // The page for missing addresses names its root by the course's base address, where this site may not be.
  if (top !== self) return null // in the frame of a learning platform, which keeps what it wants
  if (root === undefined || root.startsWith('/') || document.querySelector('script[src^="/.coursebuild/"]')) return null
  return new URL(root || './', document.baseURI)
}

/**
 * Tell the worker of a visit.
 *
 * @param {ServiceWorker} worker
 * @param {object} wish see `visit` in service-worker.js
 * @param {(told: object) => void} tell how far it is, and in the end (`end`) what came of it
 */
export function visit({ location, navigator, performance }, worker, wish, tell) {
  const { port1, port2 } = new MessageChannel()
  port1.onmessage = ({ data }) => {
    if (data.end) port1.close()
    tell(data)
  }
  const asked = {
    coursebuild: 'visit',
    pages: [location.href.split('#')[0]],
    uses: performance.getEntriesByType('resource').map(({ name }) => name),
    sparing: isSparing(navigator.connection),
    look: false,
    ...wish,
  }
  worker.postMessage(asked, [port2])
}

/** The worker of the site, ready to hear. */
export async function begun(navigator, root) {
  const registration = await navigator.serviceWorker.register(new URL(WORKER, root), { scope: root.pathname })
  if (registration.active) return registration.active
  const worker = registration.installing ?? registration.waiting
  return new Promise((done, fail) => {
    worker.addEventListener('statechange', () => {
      if (worker.state === 'activated') done(worker)
      if (worker.state === 'redundant') fail(new Error('the service worker was given up'))
    })
  })
}

/**
 * @param {Window} window
 * @param {(key: string) => string} words
 */
export function keepOffline(window, words) {
  const { document, navigator } = window
  const root = workingRoot(window)
  // What keeps the page on its own is told by it; see offline-page.js. A learning platform that shows the page keeps what it wants.
  if (!root || window.frameElement || document.querySelector('[data-keep]') || storedChoice(document) === 'none') return
  let mine = null
  const look = async (again) => {
    const worker = await begun(navigator, root)
    visit(window, worker, { keep: storedChoice(document), look: again }, ({ end, now, shown }) => {
      if (!end || !now) return
      mine ??= shown || now
      if (now !== mine) offerAgain(document, words)
    })
  }
  const start = () => setTimeout(() => look(false).catch(() => {}), CALM) // a browser may forbid it; nothing depends on it
  if (document.readyState === 'complete') start()
  else window.addEventListener('load', start)
  const lookAgain = () => look(true).catch(() => {})
  window.addEventListener('online', lookAgain)
  let hidden = 0
  document.addEventListener('visibilitychange', () => {
    if (document.hidden) hidden = Date.now()
    else if (hidden && Date.now() - hidden > AWAY) lookAgain()
  })
}

function offerAgain(document, words) {
  if (document.querySelector('.notice')) return
  const notice = document.createElement('div')
  notice.className = 'notice'
  notice.setAttribute('role', 'status')
  const button = document.createElement('button')
  button.type = 'button'
  button.textContent = words('offline.again')
  button.addEventListener('click', () => location.reload())
  document.body.append(notice)
  notice.append(words('offline.changed'), ' ', button)
}
