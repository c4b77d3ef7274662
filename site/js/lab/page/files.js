/**
 * A model of the reader's own, from files of this device: MJCF or URDF, alone, with the files that it names, or all of it in a zip.
 *
 *   const { models, files } = await readModels(fileList)
 *
 * Nothing is sent anywhere. What is read is bounded, whatever a zip claims of itself.
 */

import { LONGEST_MODEL, pipe } from './share.js'

export const MOST_BYTES = 64 << 20 // of all files, unpacked
const MOST_FILES = 2000
const MODEL = /<(?:mujoco|robot)\b/
const SCENE = /(?:^|\/)scene\.xml$/i // as collections of robots name the model that is complete
const INCLUDED = /<include\b[^>]*\bfile\s*=\s*["']([^"']+)["']/g

/** Files that hold no model that can be opened. `key`: of the text that says why. */
export class FilesError extends Error {
  constructor(key) {
    super(key)
    this.key = key
  }
}

/**
 * @param {Iterable<File>} list
 * @returns {Promise<{models: Map<string, string>, files: Map<string, Uint8Array>}>} the texts of the models, the likeliest first, and all
 *   files, by their paths
 */
export async function readModels(list) {
  const given = [...list]
  if (given.length > MOST_FILES || given.reduce((sum, { size }) => sum + size, 0) > MOST_BYTES) throw new FilesError('file_large')
  const files = new Map()
  let room = MOST_BYTES
  const add = (name, bytes) => {
    const path = pathOf(name)
    room -= bytes.length
    if (room < 0 || files.size >= MOST_FILES) throw new FilesError('file_large')
    if (path !== null) files.set(path, bytes)
  }
  for (const file of given) {
    const bytes = new Uint8Array(await file.arrayBuffer())
    if (isZip(bytes)) for await (const [name, part] of unzip(bytes, () => room)) add(name, part)
    else add(file.name, bytes)
  }
  return { models: findModels(files), files }
}

/** The path of a file inside the folder of the model; null if it has none. */
function pathOf(name) {
  const parts = name.split(/[/\\]/).filter((part) => part !== '' && part !== '.')
  return parts.length === 0 || parts.includes('..') || /[\0:]/.test(name) ? null : parts.join('/')
}

/**
 * The models that no other includes: first those of a scene, then those that include others, as scenes do, then by how high they lie.
 */
function findModels(files) {
  const texts = new Map()
  for (const [path, bytes] of files) {
    if (!/\.(?:xml|mjcf|urdf)$/i.test(path)) continue
    const text = new TextDecoder().decode(bytes)
    if (MODEL.test(text)) texts.set(path, text)
  }
  const included = new Set([...texts].flatMap(([path, text]) => [...text.matchAll(INCLUDED)].flatMap(([, file]) => placesOf(file, path))))
  const roots = [...texts.keys()].filter((path) => !included.has(path) && texts.get(path).length <= LONGEST_MODEL)
  if (roots.length === 0) throw new FilesError(texts.size === 0 ? 'file_none' : 'file_large')
  roots.sort((a, b) => a.localeCompare(b, 'en'))
  // Sorting keeps the order of equals, so that the last rank counts most.
  const ranks = [(path) => path.split('/').length, (path) => (texts.get(path).match(INCLUDED) ? 0 : 1), (path) => (SCENE.test(path) ? 0 : 1)]
  for (const rank of ranks) roots.sort((a, b) => rank(a) - rank(b))
  return new Map(roots.map((path) => [path, texts.get(path)]))
}

/** Where a file may lie that a model names: names count from the folder of the model, or of that which includes it, above it. */
function placesOf(name, model) {
  const folders = model.split('/').slice(0, -1)
  return Array.from({ length: folders.length + 1 }, (_, depth) => {
    const parts = []
    for (const part of [...folders.slice(0, depth), ...name.split(/[/\\]/)]) {
      if (part === '..') parts.pop()
      else if (part !== '.' && part !== '') parts.push(part)
    }
    return parts.join('/')
  })
}

// --- zip: the directory at its end, then each file, stored or deflated

const END = 0x06054b50
const ENTRY = 0x02014b50
const END_SIZE = 22
const LONGEST_COMMENT = 0xffff
const STORED = 0
const DEFLATED = 8
const ENCRYPTED = 1

const isZip = (bytes) => bytes[0] === 0x50 && bytes[1] === 0x4b && (bytes[2] === 3 || bytes[2] === 5)

/**
 * The files of a zip, one after the other.
 *
 * @param {Uint8Array} bytes @param {() => number} room how many bytes may still be unpacked
 * @returns {AsyncGenerator<[string, Uint8Array]>}
 */
async function* unzip(bytes, room) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength)
  try {
    const end = findEnd(view)
    const count = view.getUint16(end + 10, true)
    let at = view.getUint32(end + 16, true)
    for (let i = 0; i < count; i++) {
      if (view.getUint32(at, true) !== ENTRY) throw new RangeError('no entry')
      const [nameSize, extraSize, commentSize] = [28, 30, 32].map((offset) => view.getUint16(at + offset, true))
      const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameSize))
      if (!name.endsWith('/')) yield [name, await unpack(bytes, view, at, room())]
      at += 46 + nameSize + extraSize + commentSize
    }
  } catch (error) {
    throw error instanceof FilesError ? error : new FilesError('file_zip')
  }
}

function findEnd(view) {
  const last = view.byteLength - END_SIZE
  for (let at = last; at >= Math.max(0, last - LONGEST_COMMENT); at--) if (view.getUint32(at, true) === END) return at
  throw new RangeError('no directory')
}

/** The bytes of the file whose entry of the directory is at a place. */
async function unpack(bytes, view, entry, room) {
  const [flags, method] = [8, 10].map((offset) => view.getUint16(entry + offset, true))
  const [size, start] = [20, 42].map((offset) => view.getUint32(entry + offset, true))
  if (flags & ENCRYPTED || (method !== STORED && method !== DEFLATED)) throw new RangeError('not a plain file')
  const data = start + 30 + view.getUint16(start + 26, true) + view.getUint16(start + 28, true)
  if (data + size > bytes.length) throw new RangeError('cut off')
  const packed = bytes.subarray(data, data + size)
  if (method === STORED) return packed.slice()
  return pipe(packed, new DecompressionStream('deflate-raw'), room, new FilesError('file_large'))
}
