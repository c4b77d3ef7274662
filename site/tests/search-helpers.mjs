/** An index made under Node, as the build makes one, so that the tests of the search need no build. */

import { openPage } from '../js/search/sections.js'
import { hashOf } from '../js/page/hash.js'
import { isFuzzy, shelfOf, termsOf } from '../js/search/words.js'
import { lexicon } from '../js/search/spelling.js'
import { readShard } from '../js/search/index.js'

const DIGITS = '0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_'

function digits(value) {
  let said = ''
  let rest = value
  for (; rest > 31; rest >>= 5) said += DIGITS[(rest & 31) | 32]
  return said + DIGITS[rest]
}

/** Pages of a term, as `[page, weight]`, as a line has them. */
export function encoded(pages) {
  let before = 0
  return pages
    .map(([page, weight]) => {
      const said = digits(((page - before) << 4) | weight)
      before = page
      return said
    })
    .join('')
}

const often = (count) => (count === 1 ? 0 : count <= 3 ? 1 : count <= 9 ? 2 : 3)

/**
 * A source for `findPages`, of pages `{ title, name, kind, sections }`, sections as a page's file has them; and the text
 * of each page.
 */
export function indexed(pages, { terms = 8, words = 2 } = {}) {
  const lines = Array.from({ length: terms + words }, () => new Map())
  const asked = []
  pages.forEach((page, number) => {
    const found = new Map()
    const note = (text, field) => {
      for (const term of termsOf(text)) {
        const known = found.get(term) ?? { field: 0, count: 0 }
        found.set(term, { field: Math.max(field, known.field), count: known.count + 1 })
      }
    }
    note(`${page.name ?? ''} ${page.title}`, 3)
    for (const [, heading, , pieces, also] of page.sections) {
      note(heading, 2)
      note(also ?? '', 0)
      for (const [kind, text] of pieces) note(text, 'tf'.includes(kind) ? 1 : 0)
    }
    for (const [term, { field, count }] of found) {
      const shard = lines[hashOf(shelfOf(term)) & (terms - 1)]
      shard.set(term, [...(shard.get(term) ?? []), [number, (field << 2) | often(count)]])
      if (isFuzzy(term)) lines[terms + (hashOf(term[0]) & (words - 1))].set(term, [])
    }
  })
  const texts = lines.map((shard) => [...shard].map(([term, found]) => (found.length ? `${term} ${encoded(found)}` : term)).join('\n'))
  const kinds = [...new Set(pages.map(({ kind }) => kind ?? 'lesson'))]
  const listing = {
    terms,
    words,
    kinds,
    pages: pages.map(({ title, name = '', kind = 'lesson' }, at) => [`p${at}.html`, kinds.indexOf(kind), title, name, `f${at}`]),
  }
  const source = {
    listing,
    shard: async (number) => {
      asked.push(number)
      return readShard(texts[number])
    },
    spelling: async (number) => {
      asked.push(number)
      return lexicon(texts[number].split('\n').filter(Boolean))
    },
  }
  return { source, asked, texts, opened: pages.map(({ sections }) => openPage(sections)) }
}
