/**
 * Updates the stored files of a course. One run at a time; killed at any point, it leaves the old state, and the next run goes on.
 *
 * Entry point: `update(store, files, wish, tell)`.
 *
 * 1. Fetch the list. If it is new, fetch the files that every page needs, and only then store it.
 * 2. Fetch missing files: the visited page and what it uses, pages stored in an older version, the groups wished for.
 *    Files that did not change are stored already, under the same digest.
 * 3. Once nothing older is in use, remove old lists and the files that are in no list.
 */

import { Changed, Missing } from './fetching.js'
import { groupsFor, isLasting, parseList } from './list.js'

const AT_ONCE = 3

/**
 * @typedef {Record<string, any>} Wish
 * @property {string[]} paths that were visited, and what they use
 * @property {'auto' | 'read' | 'text' | 'all' | 'none'} keep
 * @property {boolean} sparing whether to use the network sparingly
 * @property {boolean} look whether to ask the host for a newer list
 * @property {boolean} alone whether no other page of the course is open
 */

/**
 * @param {import('./store.js').Store} store
 * @param {import('./fetching.js').Files} files
 * @param {Wish} wish
 * @param {(here: number, total: number) => void} tell reports progress
 * @returns {Promise<{here: number, total: number, full: boolean, lost: boolean}>} how many of the wished files are stored, and of how many;
 *   whether there was no more room, or the network failed
 */
export async function update(store, files, wish, tell = () => {}) {
  const outcome = { here: 0, total: 0, full: false, lost: false }
  try {
    await attempt(store, files, wish, tell, outcome).catch((error) => {
      if (!(error instanceof Changed)) throw error
      return attempt(store, files, { ...wish, look: true }, tell, outcome) // a newer build was uploaded meanwhile
    })
  } catch (error) {
    outcome.full = error?.name === 'QuotaExceededError'
    outcome.lost = !outcome.full
    if (outcome.full) await store.sweep().catch(() => {})
  }
  return outcome
}

async function attempt(store, files, wish, tell, outcome) {
  const isNewList = await takeList(store, files, wish)
  const [{ list }, ...older] = await store.lists()
  const storedKeys = await store.keys()
  const isHere = (path) => storedKeys.has(store.key(path, list.files.get(path)))
  const outdated = [...list.files.keys()].filter((path) => !isHere(path) && isOlder(store, storedKeys, older, path))
  const wished = groupsFor(wish.keep, list, wish.sparing).flatMap((group) => list.groups[group])
  const visited = wish.paths.filter((path) => list.files.has(path))
  const paths = [...new Set([...visited, ...(wish.sparing ? [] : outdated), ...wished])]
  outcome.total = paths.length
  outcome.here = paths.filter(isHere).length
  const fetchOne = async (path) => {
    try {
      await fetchInto(store, files, path, list.files.get(path))
    } catch (error) {
      if (!(error instanceof Missing)) throw error
      return // in the list but not on the host: a build is being uploaded
    }
    storedKeys.add(store.key(path, list.files.get(path)))
    outcome.here += 1
    tell(outcome.here, outcome.total)
  }
  await forEachInTurn(paths.filter((path) => !isHere(path)), fetchOne)
  if (isNewList || !wish.alone) return
  // Every open page was loaded after the newest list was stored.
  const stale = outdated.filter((path) => !isHere(path))
  if (older.length > 0 && stale.length === 0) {
    await store.setLists([(await store.lists())[0].text])
    await store.sweep()
  }
}

/** Store a newer list, if any, after the files that every page needs; returns whether there was one. */
async function takeList(store, files, wish) {
  const lists = await store.lists()
  if (lists.length > 0 && !wish.look) return false
  let text
  try {
    text = await files.list()
  } catch (error) {
    if (lists.length === 0) throw error
    return false // no network, or the site is gone: the stored files stay
  }
  if (text === lists[0]?.text) return false
  const list = parseList(text)
  const storedKeys = await store.keys()
  const missing = list.groups.shell.filter((path) => !storedKeys.has(store.key(path, list.files.get(path))))
  await forEachInTurn(missing, (path) => fetchInto(store, files, path, list.files.get(path)))
  await store.setLists([text, ...lists.map((older) => older.text)])
  return true
}

async function fetchInto(store, files, path, digest) {
  await store.put(path, digest, await files.file(path, digest))
}

/** Whether a file is stored in the version of an older list; a file with a hash in its name has a single version. */
function isOlder(store, storedKeys, older, path) {
  if (isLasting(path)) return false
  return older.some(({ list }) => list.files.has(path) && storedKeys.has(store.key(path, list.files.get(path))))
}

/** Do `work` for all paths, a few at a time; the first failure ends it. */
async function forEachInTurn(paths, work) {
  const rest = paths.values()
  const worker = async () => {
    for (const path of rest) await work(path)
  }
  await Promise.all(Array.from({ length: AT_ONCE }, worker))
}
