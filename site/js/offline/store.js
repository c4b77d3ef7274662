/**
 * The stored files of a course, each under its path and digest, and the lists that say which of them belong together.
 *
 * Entry point: `new Store(caches, scope)`. All of it is in one cache, whose name contains the scope, since courses may share an
 * origin. The newest list comes first; older ones stay as long as pages of theirs have not been fetched anew, so that such a page
 * finds the files that it was made with.
 */

import { addressOf, parseList } from './list.js'

const FORMAT = 1
const PREFIX = 'coursebuild '
const LISTS = '?lists'
/** The most lists: a reader who saves data may be some builds behind. */
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

  get name() {
    return `${PREFIX}${FORMAT} ${this.#scope}`
  }

  /** Remove this course's caches of other versions of the tool. */
  async removeOthers() {
    const isObsolete = (name) => name.startsWith(PREFIX) && name.endsWith(` ${this.#scope}`) && name !== this.name
    await Promise.all((await this.#caches.keys()).filter(isObsolete).map((name) => this.#caches.delete(name)))
  }

  async remove() {
    this.#cache = this.#lists = null
    await this.#caches.delete(this.name)
  }

  /** @returns {Promise<{text: string, list: import('./list.js').List}[]>} */
  async lists() {
    if (this.#lists === null) {
      const response = await (await this.#open()).match(this.#scope + LISTS)
      this.#lists = response ? readLists(await response.json().catch(() => [])) : []
    }
    return this.#lists
  }

  /** Replace the lists, newest first, atomically. */
  async setLists(texts) {
    const body = JSON.stringify(texts.slice(0, MOST))
    await (await this.#open()).put(this.#scope + LISTS, new Response(body, { headers: { 'Content-Type': 'application/json' } }))
    this.#lists = readLists(JSON.parse(body))
  }

  /** The key under which a file is stored. */
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

  /** The keys of all stored files. */
  async keys() {
    const requests = await (await this.#open()).keys()
    return new Set(requests.map((request) => request.url))
  }

  /** The stored version of the first of these paths, by the newest list that has one. @returns {Promise<{response: Response, digest: string} | null>} */
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

  /** Remove the files that are in no list. */
  async sweep() {
    const cache = await this.#open()
    const keys = new Set([this.#scope + LISTS])
    for (const { list } of await this.lists()) {
      for (const [path, digest] of list.files) keys.add(this.key(path, digest))
    }
    for (const request of await cache.keys()) {
      if (!keys.has(request.url)) await cache.delete(request)
    }
  }

  async #open() {
    this.#cache ??= await this.#caches.open(this.name)
    return this.#cache
  }
}

function readLists(texts) {
  const lists = []
  for (const text of Array.isArray(texts) ? texts : []) {
    try {
      lists.push({ text, list: parseList(text) })
    } catch {
      // A damaged list has no files.
    }
  }
  return lists
}
