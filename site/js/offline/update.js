/**
 * Brings what is kept of a course up to date. One run at a time; killed at any point it leaves what there was, and the next goes on.
 *
 * Entry point: `update(store, files, wish, tell)`.
 *
 * 1. The list is fetched. Where it is new, the files that every page needs are fetched first, and only then is it taken over.
 * 2. Missing files follow: the page that was visited and what it uses, pages that are here in an older state, the groups wished for.
 *    What did not change is here already, under the same digest.
 * 3. Once nothing older is in use, old lists are forgotten and files that belong to no list are removed.
 */

import { Changed, Missing } from './fetching.js'
import { groupsFor, isLasting, parseList } from './list.js'

const AT_ONCE = 3

/**
 * @typedef {object} Wish
 * @property {string[]} paths that were visited, and what they use
 * @property {'auto' | 'read' | 'text' | 'all' | 'none'} keep
 * @property {boolean} sparing whether the network is to be spared
 * @property {boolean} look whether the host is asked for a newer list
 * @property {boolean} alone whether no other page of the course is open
 */

/**
 * @typedef {object} Outcome
 * @property {number} here files of the wished groups that are here
 * @property {number} total
 * @property {boolean} full whether there was no more room
 * @property {boolean} lost whether the network failed
 */

/**
 * @param {import('./store.js').Store} store
 * @param {import('./fetching.js').Files} files
 * @param {Wish} wish
 * @param {(here: number, total: number) => void} tell how far it is
 * @returns {Promise<Outcome>}
 */
export async function update(store, files, wish, tell = () => {}) {
  const outcome = { here: 0, total: 0, full: false, lost: false }
  try {
    await attempt(store, files, wish, tell, outcome).catch((error) => {
      if (!(error instanceof Changed)) throw error
      return attempt(store, files, { ...wish, look: true }, tell, outcome) // a newer build came meanwhile
    })
  } catch (error) {
    outcome.full = error?.name === 'QuotaExceededError'
    outcome.lost = !outcome.full
    if (outcome.full) await store.sweep().catch(() => {})
  }
  return outcome
}

async function attempt(store, files, wish, tell, outcome) {
  const taken = await takeList(store, files, wish)
  const [{ list }, ...older] = await store.lists()
  const here = await store.keys()
  const isHere = (path) => here.has(store.key(path, list.files.get(path)))
  const outdated = [...list.files.keys()].filter((path) => !isHere(path) && isOlder(store, here, older, path))
  const wished = groupsFor(wish.keep, list, wish.sparing).flatMap((group) => list.groups[group])
  const visited = wish.paths.filter((path) => list.files.has(path))
  const wanted = [...new Set([...visited, ...(wish.sparing ? [] : outdated), ...wished])]
  outcome.total = wanted.length
  outcome.here = wanted.filter(isHere).length
  const fetchOne = async (path) => {
    try {
      await put(store, files, path, list.files.get(path))
    } catch (error) {
      if (!(error instanceof Missing)) throw error
      return // it is in the list and not on the host: a build that arrives in parts
    }
    here.add(store.key(path, list.files.get(path)))
    outcome.here += 1
    tell(outcome.here, outcome.total)
  }
  await inTurn(wanted.filter((path) => !isHere(path)), fetchOne)
  if (taken || !wish.alone) return
  // Whatever is open was loaded after the newest list was taken.
  const left = outdated.filter((path) => !isHere(path))
  if (older.length > 0 && left.length === 0) {
    await store.setLists([(await store.lists())[0].text])
    await store.sweep()
  }
}

/** Take over a newer list, with the files that every page needs; says whether there was one. */
async function takeList(store, files, wish) {
  const lists = await store.lists()
  if (lists.length > 0 && !wish.look) return false
  let text
  try {
    text = await files.list()
  } catch (error) {
    if (lists.length === 0) throw error
    return false // no network, or no such site any more: what is here stays
  }
  if (text === lists[0]?.text) return false
  const list = parseList(text)
  const here = await store.keys()
  const needed = list.groups.shell.filter((path) => !here.has(store.key(path, list.files.get(path))))
  await inTurn(needed, (path) => put(store, files, path, list.files.get(path)))
  await store.setLists([text, ...lists.map((one) => one.text)])
  return true
}

async function put(store, files, path, digest) {
  await store.put(path, digest, await files.file(path, digest))
}

/** Whether a file is here in the state of an older list; one with a hash in its name has one state. */
function isOlder(store, here, older, path) {
  if (isLasting(path)) return false
  return older.some(({ list }) => list.files.has(path) && here.has(store.key(path, list.files.get(path))))
}

/** A few at a time; the first failure ends it. */
async function inTurn(paths, work) {
  const rest = paths.values()
  const worker = async () => {
    for (const path of rest) await work(path)
  }
  await Promise.all(Array.from({ length: AT_ONCE }, worker))
}
