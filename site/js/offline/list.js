/**
 * The list of the site's files (`files.json`), and the addresses of what is in it. Pure.
 *
 * A path is a file's place in the site, as it is named on disk; an address is what a browser asks for. A file in `assets/` with a hash
 * in its name is the same for ever; of every other file the list holds the first digits of a hash of its content.
 */

export const FILES = 'files.json'
export const GROUPS = ['shell', 'text', 'rest']

/** Bytes of text that are fetched without being asked for: what a course of some hundred pages has, a few MB as they travel. */
export const MODEST = 16_000_000

/**
 * @typedef {object} List
 * @property {Map<string, string>} files digest by path; empty where the name has it
 * @property {Record<string, string[]>} groups paths by group
 * @property {Record<string, number>} bytes by group
 */

/** @returns {List} what the text of a list says; throws where it is none */
export function parseList(text) {
  const data = JSON.parse(text)
  if (data?.format !== 1) throw new TypeError('this is no list of files that is understood here')
  const list = { files: new Map(), groups: {}, bytes: {} }
  for (const group of GROUPS) {
    const { files, bytes } = data[group]
    if (!Number.isFinite(bytes) || Object.values(files).some((digest) => typeof digest !== 'string')) {
      throw new TypeError('the list of files is damaged')
    }
    list.groups[group] = Object.keys(files)
    list.bytes[group] = bytes
    for (const [path, digest] of Object.entries(files)) list.files.set(path, digest)
  }
  return list
}

/** Whether a file is the same for ever. */
export const isLasting = (path) => digitsOf(path) !== null

/** The digits of its content's hash that a file has in its name; `null` where it has none. */
export function digitsOf(path) {
  return /^assets\/.*\.([0-9a-f]{8})\.[a-z0-9]+$/.exec(path)?.[1] ?? null
}

/** The path that an address means; `null` where it lies elsewhere, or cannot be read. */
export function pathOf(address, scope) {
  const { origin, pathname } = new URL(address)
  const root = new URL(scope)
  if (origin !== root.origin || !pathname.startsWith(root.pathname)) return null
  try {
    return decodeURIComponent(pathname.slice(root.pathname.length))
  } catch {
    return null
  }
}

/** The address of a path. */
export function addressOf(path, scope) {
  return new URL(path.split('/').map(encodeURIComponent).join('/'), scope).href
}

/** The files that a host may mean by an address, the likeliest first: hosts leave out `index.html`, and some `.html`. */
export function pagesFor(path) {
  if (path === '' || path.endsWith('/')) return [`${path}index.html`]
  return /\.[a-z0-9]+$/i.test(path) ? [path, `${path}.html`] : [path, `${path}.html`, `${path}/index.html`]
}

/** Whether the network should be spared: where the reader says so, and where it is slow or counted. */
export function isSparing(connection) {
  if (!connection) return false
  return Boolean(connection.saveData) || connection.type === 'cellular' || /2g|3g/.test(connection.effectiveType ?? '')
}

/**
 * The groups that are to be here.
 *
 * @param {'auto' | 'read' | 'text' | 'all' | 'none'} keep what the reader wants; `auto`: has not said
 * @param {List} list
 * @param {boolean} sparing
 */
export function groupsFor(keep, list, sparing) {
  if (keep === 'all') return GROUPS
  if (keep === 'text') return ['shell', 'text']
  return keep === 'auto' && !sparing && list.bytes.shell + list.bytes.text <= MODEST ? ['shell', 'text'] : ['shell']
}

/** What one asked for of a file, `bytes=2-5`, as [first, behind the last] of so many bytes; `null` where it cannot be had. */
export function rangeOf(header, size) {
  const match = /^bytes=(\d*)-(\d*)$/.exec(header.trim())
  if (!match || (match[1] === '' && match[2] === '')) return null
  const [first, last] = match.slice(1).map((text) => (text === '' ? null : Number(text)))
  const range = first === null ? [Math.max(size - last, 0), size] : [first, Math.min((last ?? size - 1) + 1, size)]
  return range[0] < range[1] ? range : null
}
