/**
 * The search and the command palette: loaded by the page's script when it is first asked for, as a plain script, since
 * modules cannot be loaded from a disk. What it offers is the global `coursebuildSearch`:
 *
 *   open(context)    opens the dialog
 *   mount(context)   brings the page of the search to life
 *   take             what the files of the index call
 */

import { loadFile, take } from './search/data.js'
import { openDialog } from './search/dialog.js'
import { openSearch } from './search/engine.js'
import { mountPage } from './search/page.js'

let engine = null

/** The engine, made once; after a failure anew, past what the browser has kept of the list of pages. */
function ready(context) {
  engine ??= start(context, '').catch((error) => {
    engine = null
    throw error
  })
  return engine
}

function start({ root }, again) {
  return openSearch((path) => loadFile(root + path + (path.endsWith('search/index.js') ? again : '')))
}

/** A query; where files have gone because the site is newer than the list of pages, once more with a new list. */
async function find(context, query, most) {
  const search = await ready(context)
  try {
    const found = await search.find(query, most)
    if (found.complete) return found
  } catch {
    // See below: the list is loaded anew.
  }
  engine = start(context, `?${Date.now()}`)
  engine.catch(() => (engine = null))
  return (await engine).find(query, most)
}

const using = (context) => ({
  ...context,
  listing: async () => (await ready(context)).listing,
  find: (query, most) => find(context, query, most),
})

globalThis.coursebuildSearch = {
  take,
  open: (context) => openDialog(using(context)),
  mount: (context) => mountPage(using(context)),
}
