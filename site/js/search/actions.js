/**
 * What can be done on any page: commands that are made from what the page shows, and lessons by their number.
 */

import { termsOf } from './words.js'
import { filled } from './view.js'

/** The commands of a page, each with a name and a title; `href` is where it leads, `run` does it and may give a text to say. */
export function pageActions(document, strings) {
  return [...ways(document, strings), ...doings(document, strings), ...places(document)]
}

function* ways(document, strings) {
  for (const [rel, text] of [
    ['next', strings.command_next],
    ['prev', strings.command_previous],
  ]) {
    const link = document.querySelector(`.pager a[rel="${rel}"]`)
    const title = link?.querySelector('.pager-title') ?? link
    if (link) yield { id: rel, title: filled(text, { title: plain(title) }), href: link.href }
  }
}

function* doings(document, strings) {
  yield {
    id: 'link',
    title: strings.command_link,
    run: async () => {
      await navigator.clipboard.writeText(hereAddress(document))
      return strings.command_copied
    },
  }
  const read = document.querySelector('[data-progress="lesson"] button')
  if (read) yield { id: 'read', title: plain(read), run: () => read.click() }
  yield { id: 'print', title: strings.command_print, run: () => window.print() }
  const themes = document.querySelector('[data-tools] .theme select')
  for (const option of themes?.options ?? []) {
    const run = () => {
      themes.value = option.value
      themes.dispatchEvent(new Event('change', { bubbles: true }))
    }
    yield { id: `theme-${option.value}`, title: filled(strings.command_theme, { theme: option.text }), run }
  }
}

/** The pages that the site's menu and foot list. */
function* places(document) {
  const seen = new Set()
  for (const link of document.querySelectorAll('.site-nav a[href], .site-more a[href]:not([download])')) {
    if (!seen.has(link.href)) yield { id: `page ${link.href}`, title: plain(link), href: link.href }
    seen.add(link.href)
  }
}

const plain = (node) => node.textContent.replace(/\s+/g, ' ').trim()

/** The address of the section that is being read. */
export function hereAddress(document) {
  const headings = [...document.querySelectorAll('main :is(h2, h3, h4, h5, h6)[id]')]
  const read = headings.filter((heading) => heading.getBoundingClientRect().top <= innerHeight * 0.25).pop()
  return document.baseURI.split('#')[0] + (read ? `#${encodeURIComponent(read.id)}` : '')
}

/** Actions whose title has every word that was typed, or its beginning; all of them where nothing was typed. */
export function matching(actions, typed) {
  const wanted = termsOf(typed)
  return actions.filter(({ title }) => {
    const has = termsOf(title)
    return wanted.every((word) => has.some((term) => term.startsWith(word)))
  })
}

/** Pages of the course whose number begins with what was typed. */
export function numbered(listing, typed, most) {
  const number = typed.trim().toLowerCase()
  if (!/^\d[\d.]*[a-z]?$/.test(number)) return []
  const found = listing.pages.filter(([, , , name]) => name && (name.toLowerCase() === number || name.toLowerCase().startsWith(number)))
  return found.sort((a, b) => (a[3] === number ? -1 : b[3] === number ? 1 : 0)).slice(0, most)
}
