/**
 * The list of the site's files (`files.json`), and their addresses. Pure.
 *
 * A path is a file's place in the site, as on disk; an address is what a browser requests. A file in `assets/` with a hash
 * in its name never changes; of every other file the list holds the first digits of its content's hash.
 */

export const FILES = 'files.json'
const GROUPS = ['shell', 'text', 'rest']

/** The most bytes of text that are fetched without asking: a course of some hundred pages, a few MB when compressed. */
export const MODEST = 16_000_000

/**
 * @typedef {Record<string, any>} List
 * @property {Map<string, string>} files digest by path; '' if the hash is in the name
 * @property {Record<string, string[]>} groups paths by group
 * @property {Record<string, number>} bytes by group
 */

/** Parse a list; throws on any other text. @returns {List} */
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

/** Whether a file never changes. */
export const isLasting = (path) => digitsOf(path) !== null

/** The digits of the content's hash in a file's name, or `null`. */
export function digitsOf(path) {
  return /^assets\/.*\.([0-9a-f]{8})\.[a-z0-9]+$/.exec(path)?.[1] ?? null
}

/** The path of an address; `null` if it is outside the site, or malformed. */
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

export function addressOf(path, scope) {
  return new URL(path.split('/').map(encodeURIComponent).join('/'), scope).href
}

/** The files that a host may serve for a path, the likeliest first: hosts add `index.html`, and some `.html`. */
export function pagesFor(path) {
  if (path === '' || path.endsWith('/')) return [`${path}index.html`]
  return /\.[a-z0-9]+$/i.test(path) ? [path, `${path}.html`] : [path, `${path}.html`, `${path}/index.html`]
}

/** Whether to use the network sparingly: if the reader wants to save data, or it is slow or metered. */
export function isSparing(connection) {
  if (!connection) return false
  return Boolean(connection.saveData) || connection.type === 'cellular' || /2g|3g/.test(connection.effectiveType ?? '')
}

/**
 * The groups to store.
 *
 * @param {string} keep the reader's choice; `auto`: none yet
 * @param {List} list
 * @param {boolean} sparing
 */
export function groupsFor(keep, list, sparing) {
  if (keep === 'all') return GROUPS
  if (keep === 'text') return ['shell', 'text']
  return keep === 'auto' && !sparing && list.bytes.shell + list.bytes.text <= MODEST ? ['shell', 'text'] : ['shell']
}

/** The range of a `Range` header, `bytes=2-5`, in a file of `size` bytes, as [start, end]; `null` if it cannot be satisfied. */
export function rangeOf(header, size) {
  const match = /^bytes=(\d*)-(\d*)$/.exec(header.trim())
  if (!match || (match[1] === '' && match[2] === '')) return null
  const [first, last] = match.slice(1).map((text) => (text === '' ? null : Number(text)))
  const range = first === null ? [Math.max(size - last, 0), size] : [first, Math.min((last ?? size - 1) + 1, size)]
  return range[0] < range[1] ? range : null
}
