/**
 * Fetches files of the site so that what is kept is what the list says.
 *
 * Entry point: `new Files(scope, fetch)`. A file comes from the browser's own cache where its hash is the one of the list, else from
 * the host. One that is still another may be changed by the host on its way (some rewrite pages): it is taken where the list is the
 * newest and it is of the right kind. Otherwise a newer build is arriving, and `Changed` says so.
 */

import { FILES, addressOf, digitsOf } from './list.js'

/** What is on the host is no more what the list says. */
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

  /** The text of the list that is on the host. */
  async list() {
    const response = await this.#fetch(new URL(FILES, this.#scope).href, { cache: 'no-cache' })
    if (!response.ok) throw new Missing(`the host says ${response.status}`)
    this.#newest = await response.text()
    return this.#newest
  }

  /** A file as it may be kept. @returns {Promise<Response>} */
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

/** A response that was followed, unpacked and read: it can be kept under another address and be given for a page. */
export async function plain(response) {
  const body = await response.arrayBuffer()
  const type = response.headers.get('Content-Type')
  const headers = { 'Content-Length': String(body.byteLength), ...(type ? { 'Content-Type': type } : {}) }
  return { body, type, response: () => new Response(body, { headers }) }
}

/** Whether bytes are those of a file, by the hash in the list, or else in its name. */
export async function isWhole(path, digest, body) {
  const bytes = new Uint8Array(await crypto.subtle.digest('SHA-256', body))
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('')
  return digits.startsWith(digest || digitsOf(path))
}
