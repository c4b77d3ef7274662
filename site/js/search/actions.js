/**
 * The actions of a page: commands made from its elements, and lessons by their number.
 */

import { fill } from '../page/words.js'
import { termsOf } from './words.js'

/** The commands of a page, each with a title; `href` is its target, `run` does it and may return a message. */
export function pageActions(document, strings) {
  return [...pageLinks(document, strings), ...commands(document, strings), ...menuPages(document)]
}

function* pageLinks(document, strings) {
  for (const [rel, text] of [
    ['next', strings.command_next],
    ['prev', strings.command_previous],
  ]) {
    const link = document.querySelector(`.pager a[rel="${rel}"]`)
    const title = link?.querySelector('.pager-title') ?? link
    if (link) yield { title: fill(text, { title: plain(title) }), href: link.href }
  }
}

function* commands(document, strings) {
  yield {
    title: strings.command_link,
    run: async () => {
      await navigator.clipboard.writeText(hereAddress(document))
      return strings.command_copied
    },
  }
  const read = document.querySelector('[data-progress="lesson"] button')
  if (read) yield { title: plain(read), run: () => read.click() }
  yield { title: strings.command_print, run: () => window.print() }
  const themes = document.querySelector('[data-tools] .theme select')
  for (const option of themes?.options ?? []) {
    const run = () => {
      themes.value = option.value
      themes.dispatchEvent(new Event('change', { bubbles: true }))
    }
    yield { title: fill(strings.command_theme, { theme: option.text }), run }
  }
}

/** The pages that the site's menu and foot list. */
function* menuPages(document) {
  const hrefs = new Set()
  for (const link of document.querySelectorAll('.site-nav a[href], .site-more a[href]:not([download])')) {
    if (!hrefs.has(link.href)) yield { title: plain(link), href: link.href }
    hrefs.add(link.href)
  }
}

const plain = (node) => node.textContent.replace(/\s+/g, ' ').trim()

/** The address of the current section. */
function hereAddress(document) {
  const headings = [...document.querySelectorAll('main :is(h2, h3, h4, h5, h6)[id]')]
  const current = headings.findLast((heading) => heading.getBoundingClientRect().top <= innerHeight * 0.25)
  return document.baseURI.split('#')[0] + (current ? `#${encodeURIComponent(current.id)}` : '')
}

/** The actions whose title has a word beginning with each word of the query; all of them for an empty query. */
export function matchActions(actions, query) {
  const terms = termsOf(query)
  return actions.filter(({ title }) => {
    const titleTerms = termsOf(title)
    return terms.every((word) => titleTerms.some((term) => term.startsWith(word)))
  })
}

/** The pages of the course whose number begins with the query. */
export function pagesByNumber(listing, query, limit) {
  const number = query.trim().toLowerCase()
  if (!/^\d[\d.]*[a-z]?$/.test(number)) return []
  const pages = listing.pages.filter(([, , , name]) => name && (name.toLowerCase() === number || name.toLowerCase().startsWith(number)))
  return pages.sort((a, b) => (a[3] === number ? -1 : b[3] === number ? 1 : 0)).slice(0, limit)
}
