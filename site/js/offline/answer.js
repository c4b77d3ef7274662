/**
 * What the worker answers a page's requests with.
 *
 * Entry point: `answer(request, around)`; `isOurs` says which requests are answered at all.
 *
 * - A page comes from the network. Where that does not answer in time, it comes from here; where it is not here, the page that says so.
 * - A file with a hash in its name comes from here, else from the network, and is kept then: it is the same for ever.
 * - Every other file comes from the network, and from here where that fails.
 */

import { isWhole, plain } from './fetching.js'
import { addressOf, isLasting, pagesFor, pathOf, rangeOf } from './list.js'

/** Milliseconds that a page may take before the one that is kept is shown. */
export const PATIENCE = 3000
export const OFFLINE = 'offline/index.html'

/** Whether a request is for a file of this site. */
export function isOurs(request, scope) {
  const path = pathOf(request.url, scope)
  if (request.method !== 'GET' || path === null) return false
  // The preview's own files, and the worker and its list, always come from the host.
  return !/^(\.coursebuild\/|service-worker\.js$|files\.json$)/.test(path)
}

/**
 * @typedef {object} Around
 * @property {import('./store.js').Store} store
 * @property {typeof fetch} fetch
 * @property {Promise<Response | undefined>} [preload] what the browser began to fetch itself
 * @property {(ms: number) => Promise<void>} wait
 * @property {(work: Promise<unknown>) => void} later keeps the worker alive for work that the answer does not wait for
 * @property {(digest: string) => void} shown is told that a page is one that was kept
 */

/**
 * @param {Request} request one that `isOurs`
 * @param {Around} around
 * @returns {Promise<Response>}
 */
export function answer(request, around) {
  const path = pathOf(request.url, around.store.scope)
  if (request.mode === 'navigate') return page(request, path, around)
  if (request.headers.has('Range')) return part(request, path, around)
  return isLasting(path) ? lasting(request, path, around) : file(request, path, around)
}

async function page(request, path, { store, fetch, preload, wait, later, shown }) {
  const network = Promise.resolve(preload)
    .then((loaded) => loaded ?? fetch(request))
    .then(
      (response) => ({ response }),
      (error) => ({ error }),
    )
  const early = await Promise.race([network, wait(PATIENCE)])
  if (early?.response && early.response.status < 500) return early.response
  const kept = await store.find(pagesFor(path))
  if (kept) {
    later(network)
    shown(kept.digest)
    return kept.response
  }
  const { response } = await network
  if (response) return response
  if (pagesFor(path).includes(OFFLINE) || !(await store.find([OFFLINE]))) return Response.error()
  const from = new URL(request.url)
  const place = new URL(addressOf('offline/', store.scope))
  place.searchParams.set('from', from.pathname + from.search)
  return Response.redirect(place.href, 302)
}

async function lasting(request, path, { store, fetch, later }) {
  const kept = (await store.get(path, '')) ?? (await store.find([path]))?.response
  if (kept) return kept
  const response = await fetch(request)
  if (response.status === 200 && response.type === 'basic') later(keep(store, path, response.clone()))
  return response
}

/** Keep a file that was used, where it is the one that its name says. */
async function keep(store, path, response) {
  try {
    const read = await plain(response)
    if ((await store.lists()).length > 0 && (await isWhole(path, '', read.body))) {
      await store.put(path, '', read.response())
    }
  } catch {
    // It did not come to its end, or there is no room.
  }
}

async function file(request, path, { store, fetch }) {
  try {
    return await fetch(request)
  } catch (error) {
    const kept = await store.find([path])
    if (kept) return kept.response
    throw error
  }
}

/** A part of a file: films are asked for in parts. */
async function part(request, path, { store, fetch }) {
  const kept = isLasting(path) ? await store.get(path, '') : null
  if (kept) return cut(kept, request.headers.get('Range'))
  try {
    return await fetch(request)
  } catch (error) {
    const found = await store.find([path])
    if (found) return cut(found.response, request.headers.get('Range'))
    throw error
  }
}

async function cut(response, header) {
  const body = await response.arrayBuffer()
  const range = rangeOf(header, body.byteLength)
  if (!range) return new Response(null, { status: 416, headers: { 'Content-Range': `bytes */${body.byteLength}` } })
  const headers = new Headers(response.headers)
  headers.set('Content-Range', `bytes ${range[0]}-${range[1] - 1}/${body.byteLength}`)
  headers.set('Content-Length', String(range[1] - range[0]))
  return new Response(body.slice(...range), { status: 206, headers })
}
