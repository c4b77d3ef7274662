/**
 * The versions of a course whose sites stand beside each other: a list in the page's head, and a note on older ones.
 *
 * `versions.json` has them, the newest first: `version`, the address `root` of its site as seen from this one and, where it is
 * known, the `pages` that it has. A link leads to the same page of the other version, else to its home page.
 */

import { h } from '../lab/page/dom.js'

export async function showVersions(document) {
  const place = document.querySelector('[data-version]')
  if (!place || location.protocol === 'file:') return // where no list can be read
  const root = new URL(document.documentElement.dataset.root || './', location.href)
  const versions = await readList(new URL('versions.json', root))
  if (versions.length < 2) return
  const page = location.href.startsWith(root.href) ? location.pathname.slice(root.pathname.length) : ''
  const links = versions.map((entry) => linkTo(entry, page, root, place.dataset.version))
  const list = h('ul', {}, ...links.map((link) => h('li', {}, link)))
  place.replaceChildren(h('details', {}, h('summary', {}, place.textContent), list))
  if (versions[0].version === place.dataset.version) return
  const newest = h('a', { href: links[0].href }, place.dataset.newest)
  document.querySelector('.site-head').after(h('p', { className: 'older-version' }, `${place.dataset.older} `, newest))
}

/** @returns {Promise<{ version: string, root: string, pages?: string[] }[]>} empty without a network and a stored list */
async function readList(url) {
  try {
    const response = await fetch(url, { cache: 'no-cache' })
    return response.ok ? await response.json() : []
  } catch {
    return []
  }
}

/** @returns {HTMLAnchorElement} */
function linkTo({ version, root, pages = [] }, page, here, ownVersion) {
  const link = h('a', { href: new URL((pages.includes(page) && page) || './', new URL(root, here)).href }, version)
  if (version === ownVersion) link.ariaCurrent = 'true'
  return link
}
