/**
 * What is kept of one course: files, each under its path and digest, and the lists that say which of them belong together.
 *
 * Entry point: `new Store(caches, scope)`. All of it lies in one cache, whose name has the scope in it, since several courses may have
 * one origin. The newest list comes first; older ones stay as long as pages of theirs are here that have not been fetched anew, so
 * that such a page finds the files that it was made with.
 */

import { addressOf, parseList } from './list.js'

const FORMAT = 1
const PREFIX = 'coursebuild '
const LISTS = '?lists'
/** Lists that are held at most: a reader who saves data may be some builds behind. */
const MOST = 3

export class Store {
  #caches
  #scope
  #cache = null
  #lists = null

  /**
   * @param {CacheStorage} caches
   * @param {string} scope the address of the site's root
   */
  constructor(caches, scope) {
    this.#caches = caches
    this.#scope = scope
  }

  get scope() {
    return this.#scope
  }

  /** The name of its cache. */
  get name() {
    return `${PREFIX}${FORMAT} ${this.#scope}`
  }

  /** Remove what other versions of the tool kept of this course. */
  async removeOthers() {
    const own = (name) => name.startsWith(PREFIX) && name.endsWith(` ${this.#scope}`) && name !== this.name
    await Promise.all((await this.#caches.keys()).filter(own).map((name) => this.#caches.delete(name)))
  }

  /** Forget everything. */
  async remove() {
    this.#cache = this.#lists = null
    await this.#caches.delete(this.name)
  }

  /** @returns {Promise<{text: string, list: import('./list.js').List}[]>} */
  async lists() {
    if (this.#lists === null) {
      const kept = await (await this.#open()).match(this.#scope + LISTS)
      this.#lists = kept ? understood(await kept.json().catch(() => [])) : []
    }
    return this.#lists
  }

  /** Put a list before the others, or only it in the place of all. Whole or not at all. */
  async setLists(texts) {
    const body = JSON.stringify(texts.slice(0, MOST))
    await (await this.#open()).put(this.#scope + LISTS, new Response(body, { headers: { 'Content-Type': 'application/json' } }))
    this.#lists = understood(JSON.parse(body))
  }

  /** The name that a file is kept under. */
  key(path, digest) {
    return addressOf(path, this.#scope) + (digest && `?${digest}`)
  }

  /** @returns {Promise<Response | undefined>} */
  async get(path, digest) {
    return (await this.#open()).match(this.key(path, digest))
  }

  async put(path, digest, response) {
    await (await this.#open()).put(this.key(path, digest), response)
  }

  /** The names of all files that are here. */
  async keys() {
    const requests = await (await this.#open()).keys()
    return new Set(requests.map((request) => request.url))
  }

  /** A page or file as the newest list that has it here says. @returns {Promise<{response: Response, digest: string} | null>} */
  async find(paths) {
    for (const { list } of await this.lists()) {
      for (const path of paths) {
        const digest = list.files.get(path)
        const response = digest === undefined ? undefined : await this.get(path, digest)
        if (response) return { response, digest }
      }
    }
    return null
  }

  /** Remove what no list has. */
  async sweep() {
    const cache = await this.#open()
    const needed = new Set([this.#scope + LISTS])
    for (const { list } of await this.lists()) {
      for (const [path, digest] of list.files) needed.add(this.key(path, digest))
    }
    for (const request of await cache.keys()) {
      if (!needed.has(request.url)) await cache.delete(request)
    }
  }

  async #open() {
    this.#cache ??= await this.#caches.open(this.name)
    return this.#cache
  }
}

function understood(texts) {
  const found = []
  for (const text of Array.isArray(texts) ? texts : []) {
    try {
      found.push({ text, list: parseList(text) })
    } catch {
      // A damaged list has no files.
    }
  }
  return found
}
