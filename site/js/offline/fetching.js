/**
 * Fetches the site's files in the versions of the list.
 *
 * Entry point: `new Files(scope, fetch)`. A file comes from the browser's own cache if its hash is that of the list, else from
 * the host. If the host's file has another hash, too, the host may rewrite pages: the file is accepted if the list is still the
 * newest and the file is of the right kind. Otherwise a newer build is being uploaded, and `Changed` is thrown.
 */

import { FILES, addressOf, digitsOf } from './list.js'

/** The host has another version than the list. */
export class Changed extends Error {}

/** The file is not on the host. */
export class Missing extends Error {}

export class Files {
  #scope
  #fetch
  #newest = null

  constructor(scope, fetch) {
    this.#scope = scope
    this.#fetch = fetch
  }

  /** Fetch the text of the host's list. */
  async list() {
    const response = await this.#fetch(new URL(FILES, this.#scope).href, { cache: 'no-cache' })
    if (!response.ok) throw new Missing(`the host says ${response.status}`)
    this.#newest = await response.text()
    return this.#newest
  }

  /** Fetch a file for the store. @returns {Promise<Response>} */
  async file(path, digest) {
    let last = null
    for (const cache of ['default', 'no-cache']) {
      const response = await this.#fetch(addressOf(path, this.#scope), { cache, priority: 'low' })
      if (response.status === 404 || response.status === 410) throw new Missing(path)
      if (response.status !== 200) throw new TypeError(`the host says ${response.status}`)
      last = await plain(response)
      if (await isWhole(path, digest, last.body)) return last.response()
    }
    const page = (last.type ?? '').includes('text/html')
    if (page !== path.endsWith('.html') || this.#newest !== (await this.list())) throw new Changed(path)
    return last.response()
  }
}

/** Read a response into a plain one, without redirects and compression, which can be stored and answer a navigation. */
export async function plain(response) {
  const body = await response.arrayBuffer()
  const type = response.headers.get('Content-Type')
  const headers = { 'Content-Length': String(body.byteLength), ...(type ? { 'Content-Type': type } : {}) }
  return { body, type, response: () => new Response(body, { headers }) }
}

/** Whether bytes have the hash of a file, which stands in the list or in its name. */
export async function isWhole(path, digest, body) {
  const bytes = new Uint8Array(await crypto.subtle.digest('SHA-256', body))
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('')
  return digits.startsWith(digest || digitsOf(path))
}
