/** A cache storage, a host and a course for the tests of what is kept. */

import { createHash } from 'node:crypto'

export const SCOPE = 'https://example.org/course/'

const digest = (text) => createHash('sha256').update(text).digest('hex')

/** The caches of an origin, as far as they are used; `room` is how many files fit. */
export class FakeCaches {
  stores = new Map()
  room = Infinity

  async open(name) {
    if (!this.stores.has(name)) this.stores.set(name, new Map())
    const store = this.stores.get(name)
    const url = (request) => request.url ?? request
    return {
      match: async (request) => store.get(url(request))?.clone(),
      put: async (request, response) => {
        if (!store.has(url(request)) && store.size >= this.room) throw new DOMException('no room', 'QuotaExceededError')
        store.set(url(request), response)
      },
      delete: async (request) => store.delete(url(request)),
      keys: async () => [...store.keys()].map((address) => ({ url: address })),
    }
  }

  async keys() {
    return [...this.stores.keys()]
  }

  async delete(name) {
    return this.stores.delete(name)
  }
}

/** A build of a course: its files by path, and the list of them. */
export function built(pages, { shell = ['index.html', 'offline/index.html'], rest = [] } = {}) {
  const files = new Map(Object.entries(pages).map(([path, text]) => [path.replace('HASH', digest(text).slice(0, 8)), text]))
  const data = { format: 1 }
  for (const group of ['shell', 'text', 'rest']) data[group] = { bytes: 0, files: {} }
  for (const [path, text] of files) {
    const lasting = path.startsWith('assets/') && path.includes(digest(text).slice(0, 8))
    const group = rest.some((start) => path.startsWith(start)) ? 'rest' : shell.includes(path) || path.endsWith('.css') ? 'shell' : 'text'
    data[group].files[path] = lasting ? '' : digest(text).slice(0, 12)
    data[group].bytes += text.length
  }
  files.set('files.json', JSON.stringify(data))
  return files
}

/** A host: what it has, what it was asked for, and whether it answers. */
export class Host {
  asked = []
  up = true
  before = async () => {}

  constructor(files) {
    this.files = files
  }

  fetch = async (request, options = {}) => {
    const address = request.url ?? request
    const path = decodeURIComponent(new URL(address).pathname.slice(new URL(SCOPE).pathname.length)) || 'index.html'
    this.asked.push(path)
    await this.before(path, options)
    if (!this.up) throw new TypeError('no network')
    const text = this.files.get(path)
    if (text === undefined) return answered('<p>missing</p>', 404, 'text/html')
    return answered(text, 200, path.endsWith('.html') ? 'text/html; charset=utf-8' : 'text/plain')
  }

  /** What it was asked for since it was asked this the last time. */
  since() {
    return this.asked.splice(0).sort()
  }
}

function answered(text, status, type) {
  const response = new Response(text, { status, headers: { 'Content-Type': type, 'Content-Encoding': 'br' } })
  Object.defineProperty(response, 'type', { value: 'basic' })
  const clone = response.clone.bind(response)
  response.clone = () => Object.defineProperty(clone(), 'type', { value: 'basic' })
  return response
}
