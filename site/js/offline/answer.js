/**
 * The service worker's answers to the requests of pages.
 *
 * Entry point: `answer(request, services)`; `isOurs` says which requests are answered at all.
 *
 * - A page comes from the network; if that does not answer in time, from the store; if it is not there, the page about this is shown.
 * - A file with a hash in its name comes from the store, else from the network, and is then stored: it never changes.
 * - Every other file comes from the network, or from the store if that fails.
 */

import { isWhole, plain } from './fetching.js'
import { addressOf, isLasting, pagesFor, pathOf, rangeOf } from './list.js'

/** Milliseconds that a page may take before its stored copy is shown. */
const PATIENCE = 3000
const OFFLINE = 'offline/index.html'

/** Whether a request is for a file of this site. */
export function isOurs(request, scope) {
  const path = pathOf(request.url, scope)
  if (request.method !== 'GET' || path === null) return false
  // The preview's own files, and the worker and its list, always come from the host.
  return !/^(\.coursebuild\/|service-worker\.js$|files\.json$)/.test(path)
}

/**
 * @typedef {object} Services
 * @property {import('./store.js').Store} store
 * @property {typeof fetch} fetch
 * @property {Promise<Response | undefined>} [preload] the browser's own request, begun while the worker started
 * @property {(ms: number) => Promise<undefined>} wait
 * @property {(work: Promise<unknown>) => void} waitUntil keeps the worker alive for work that outlasts the answer
 * @property {(digest: string) => void} onStored is called when a stored page is shown
 */

/**
 * @param {Request} request one that `isOurs`
 * @param {Services} services
 * @returns {Promise<Response>}
 */
export function answer(request, services) {
  const path = pathOf(request.url, services.store.scope)
  if (request.mode === 'navigate') return answerPage(request, path, services)
  if (request.headers.has('Range')) return answerPart(request, path, services)
  return isLasting(path) ? answerLasting(request, path, services) : answerFile(request, path, services)
}

/** @param {Request} request @param {string} path @param {Services} services */
async function answerPage(request, path, { store, fetch, preload, wait, waitUntil, onStored }) {
  const network = Promise.resolve(preload)
    .then((preloaded) => preloaded ?? fetch(request))
    .then(
      (response) => ({ response, error: null }),
      (error) => ({ response: null, error }),
    )
  const earliest = await Promise.race([network, wait(PATIENCE)])
  if (earliest?.response && earliest.response.status < 500) return earliest.response
  const copy = await store.find(pagesFor(path))
  if (copy) {
    waitUntil(network)
    onStored(copy.digest)
    return copy.response
  }
  const { response } = await network
  if (response) return response
  if (pagesFor(path).includes(OFFLINE) || !(await store.find([OFFLINE]))) return Response.error()
  const url = new URL(request.url)
  const place = new URL(addressOf('offline/', store.scope))
  place.searchParams.set('from', url.pathname + url.search)
  return Response.redirect(place.href, 302)
}

async function answerLasting(request, path, { store, fetch, waitUntil }) {
  const copy = (await store.get(path, '')) ?? (await store.find([path]))?.response
  if (copy) return copy
  const response = await fetch(request)
  if (response.status === 200 && response.type === 'basic') waitUntil(storeUsed(store, path, response.clone()))
  return response
}

/** Store a file that was used, if its content has the hash in its name. */
async function storeUsed(store, path, response) {
  try {
    const read = await plain(response)
    if ((await store.lists()).length > 0 && (await isWhole(path, '', read.body))) {
      await store.put(path, '', read.response())
    }
  } catch {
    // The response was cut short, or there is no room.
  }
}

async function answerFile(request, path, { store, fetch }) {
  try {
    return await fetch(request)
  } catch (error) {
    const copy = await store.find([path])
    if (copy) return copy.response
    throw error
  }
}

/** Answer with a range of a file: browsers request videos in ranges. */
async function answerPart(request, path, services) {
  const copy = isLasting(path) ? await services.store.get(path, '') : null
  const response = copy ?? (await answerFile(request, path, services))
  return response.status === 200 ? sliceOf(response, request.headers.get('Range')) : response
}

async function sliceOf(response, header) {
  const body = await response.arrayBuffer()
  const range = rangeOf(header, body.byteLength)
  if (!range) return new Response(null, { status: 416, headers: { 'Content-Range': `bytes */${body.byteLength}` } })
  const headers = new Headers(response.headers)
  headers.set('Content-Range', `bytes ${range[0]}-${range[1] - 1}/${body.byteLength}`)
  headers.set('Content-Length', String(range[1] - range[0]))
  return new Response(body.slice(...range), { status: 206, headers })
}
