/**
 * The search of a course: a query in, pages with their sections out.
 *
 * Entry point: `openSearch(load)`.
 */

import { memoize } from '../page/scripts.js'
import { pageFile, readShard, shardFile } from './index.js'
import { byRank, findPages } from './pages.js'
import { excerpt, findSections, markWords, openPage, phraseFactor, trail } from './sections.js'
import { lexicon } from './spelling.js'

const LISTING = 'search/index.js'
const SHARDS = 96 // that are cached, and so on
const SPELLINGS = 40
const PAGES = 80
const SECTIONS = 3 // of a page, in its result
const AHEAD = 2 // pages beyond those shown, as their texts may change the order
const BREATH = 15 // ms of work after which the browser may do something else

/**
 * @param {(path: string) => Promise<any>} load loads the value of a file by its path from the site's root
 */
export async function openSearch(load) {
  const listing = await load(LISTING)
  const source = {
    listing,
    shard: memoize(async (number) => readShard(await load(shardFile(listing, number))), SHARDS),
    spelling: memoize(async (number) => lexicon((await load(shardFile(listing, number))).split('\n').filter(Boolean)), SPELLINGS),
  }
  const file = memoize(load, PAGES)
  const text = memoize(async (number) => openPage((await file(pageFile(listing.pages[number])))[listing.pages[number][5]]), PAGES)

  /** The first `limit` pages for a query with their sections, the number of all pages, and the respelt words. */
  async function find(query, limit) {
    const { pages, words } = await findPages(query, source)
    const candidates = pages.slice(0, limit + AHEAD)
    let complete = true
    const texts = await Promise.all(
      candidates.map(({ page }) =>
        text(page).catch(() => {
          complete = false
          return null
        }),
      ),
    )
    const results = []
    let sliceStart = performance.now()
    for (const [index, { page, score }] of candidates.entries()) {
      results.push(makeResult(listing, page, texts[index], words, score))
      if (performance.now() - sliceStart < BREATH) continue
      await new Promise((resolve) => setTimeout(resolve))
      sliceStart = performance.now()
    }
    results.sort(byRank)
    const instead = words.filter(({ instead }) => instead !== null).map(({ instead }) => instead)
    return { query, pages: results.slice(0, limit), count: pages.length, instead, complete }
  }

  return { listing, find }
}

function makeResult(listing, number, page, words, score) {
  const [path, kind, title, name] = listing.pages[number]
  const result = { path, kind: listing.kinds[kind], name, title: markWords(title, words), score, hits: [] }
  if (page === null) return result
  result.score *= phraseFactor(page, title, words)
  const hits = findSections(page, words)
  const mostWords = hits[0]?.words ?? 0
  result.hits = hits
    .filter((hit) => hit.words === mostWords)
    .slice(0, SECTIONS)
    .map(({ at: index }) => ({
      anchor: page.sections[index][0],
      trail: trail(page.sections, index).map((heading) => markWords(heading, words)),
      excerpt: excerpt(page.sections[index], words),
    }))
  return result
}
