/**
 * The search and the command palette: loaded by the page's script on first use, as a classic script, since modules cannot
 * be loaded from disk. Its interface is the global `coursebuildSearch`:
 *
 *   open(context)    opens the dialog
 *   mount(context)   mounts the search page
 *   take             called by the files of the index
 */

import { loadScript } from './page/scripts.js'
import { openDialog } from './search/dialog.js'
import { openSearch } from './search/engine.js'
import { mountPage } from './search/page.js'

const arrivals = new WeakMap() // script element → its value

/** Called by the files while they run. */
function take(kind, name, value) {
  arrivals.set(document.currentScript, value)
}

/** The value that a file of the index passes: browsers load scripts from disk, but no other data. */
async function loadFile(address) {
  const script = await loadScript(address)
  script.remove()
  if (!arrivals.has(script)) throw new Error(address)
  return arrivals.get(script)
}

let engine = null

/** The engine, made once; after a failure it is made again, bypassing the browser's cache of the list of pages. */
function getEngine(context) {
  engine ??= start(context, '').catch((error) => {
    engine = null
    throw error
  })
  return engine
}

function start({ root }, suffix) {
  return openSearch((path) => loadFile(root + path + (path.endsWith('search/index.js') ? suffix : '')))
}

/** Search; if files are missing because the site is newer than the list of pages, search again with a new list. */
async function find(context, query, limit) {
  const search = await getEngine(context)
  try {
    const result = await search.find(query, limit)
    if (result.complete) return result
  } catch {
    // The list is loaded anew below.
  }
  engine = start(context, `?${Date.now()}`)
  engine.catch(() => (engine = null))
  return (await engine).find(query, limit)
}

const withSearch = (context) => ({
  ...context,
  listing: async () => (await getEngine(context)).listing,
  find: (query, limit) => find(context, query, limit),
})

globalThis.coursebuildSearch = {
  take,
  open: (context) => openDialog(withSearch(context)),
  mount: (context) => mountPage(withSearch(context)),
}
