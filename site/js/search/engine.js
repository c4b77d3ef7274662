/**
 * The search of a course: a query in, pages with their sections out.
 *
 * Entry point: `openSearch(load)`.
 */

import { pageFile, readShard, shardFile } from './index.js'
import { remembered } from './data.js'
import { findPages } from './pages.js'
import { excerpt, findSections, marked, openPage, phraseFactor, trail } from './sections.js'
import { lexicon } from './spelling.js'

const LISTING = 'search/index.js'
const SHARDS = 96 // that are remembered, and so on
const SPELLINGS = 40
const PAGES = 80
const SECTIONS = 3 // of a page that are shown
const AHEAD = 2 // pages more than are shown, of which the text may change the order
const BREATH = 15 // ms of work after which the page may do something else

/**
 * @param {(path: string) => Promise<unknown>} load gives the value of a file by its path from the site's root
 */
export async function openSearch(load) {
  const listing = await load(LISTING)
  const source = {
    listing,
    shard: remembered(async (number) => readShard(await load(shardFile(listing, number))), SHARDS),
    spelling: remembered(async (number) => lexicon((await load(shardFile(listing, number))).split('\n').filter(Boolean)), SPELLINGS),
  }
  const text = remembered(async (number) => openPage(await load(pageFile(listing.pages[number]))), PAGES)

  /** The first `most` pages that a query means, what was found on each, how many there are, and which words were respelt. */
  async function find(query, most) {
    const { pages, words } = await findPages(query, source)
    const shown = pages.slice(0, most + AHEAD)
    let complete = true
    const read = await Promise.all(
      shown.map(({ page }) =>
        text(page).catch(() => {
          complete = false
          return null
        }),
      ),
    )
    const found = []
    let began = performance.now()
    for (const [at, { page, score }] of shown.entries()) {
      found.push(described(listing, page, read[at], words, score))
      if (performance.now() - began < BREATH) continue
      await new Promise((go) => setTimeout(go))
      began = performance.now()
    }
    found.sort((a, b) => b.score - a.score)
    const instead = words.filter(({ instead }) => instead !== null).map(({ instead }) => instead)
    return { query, pages: found.slice(0, most), count: pages.length, instead, complete }
  }

  return { listing, find }
}

/** A page as a result. */
function described(listing, number, page, words, score) {
  const [path, kind, title, name] = listing.pages[number]
  const result = { path, kind: listing.kinds[kind], name, title: marked(title, words), score, hits: [] }
  if (page === null) return result
  result.score *= phraseFactor(page, title, words)
  const found = findSections(page, words)
  const most = found[0]?.words ?? 0
  result.hits = found
    .filter((hit) => hit.words === most)
    .slice(0, SECTIONS)
    .map(({ at }) => ({
      anchor: page.sections[at][0],
      trail: trail(page.sections, at).map((heading) => marked(heading, words)),
      excerpt: excerpt(page.sections[at], words),
    }))
  return result
}
