/** The page of the search: a form, and under it the results as a list that is read like any text. */

import { noteQuery } from './recent.js'
import { address, element, hitParts, pageTitle, summary } from './view.js'

const STEP = 15 // pages at a time
const WAIT = 200 // ms after the last key

/** Bring the form to life; what the address asks for is searched at once. */
export async function mountPage(context) {
  const form = document.querySelector('[data-search-form]')
  const input = form.querySelector('input')
  const place = document.querySelector('[data-search-results]')
  const status = element('p', { class: 'search-status', role: 'status' })
  const list = element('ol', { class: 'found-pages' })
  const more = element('button', { type: 'button', class: 'search-more', hidden: true })
  place.replaceChildren(status, list, more)
  let asked = 0
  let most = STEP
  let timer = 0

  const search = async ({ keep = false } = {}) => {
    const query = input.value.trim()
    const mine = ++asked
    if (!keep) most = STEP
    if (query === '') return show(null, query)
    try {
      const [found, listing] = [await context.find(query, most), await context.listing()]
      if (mine === asked) show(found, query, listing.strings)
    } catch {
      if (mine === asked) status.textContent = document.querySelector('#_words').content.querySelector('[data-key="search.failed"]').textContent
    }
  }

  const show = (found, query, strings) => {
    const had = list.children.length
    status.textContent = found ? summary(found, strings) + (found.count === 0 ? ` ${strings.advice}` : '') : ''
    list.replaceChildren(...(found?.pages ?? []).map((page) => pageItem(page, context.root, strings)))
    more.hidden = !found || found.count <= most
    more.textContent = strings?.more ?? ''
    history.replaceState(history.state, '', query ? `?q=${encodeURIComponent(query)}` : location.pathname)
    return had
  }

  form.addEventListener('submit', (event) => {
    event.preventDefault()
    clearTimeout(timer)
    noteQuery(context.course, input.value)
    search()
  })
  input.addEventListener('input', () => {
    clearTimeout(timer)
    timer = setTimeout(search, WAIT)
  })
  more.addEventListener('click', async () => {
    const had = list.children.length
    most += STEP
    await search({ keep: true })
    list.children[had]?.querySelector('a').focus()
  })
  input.value = new URLSearchParams(location.search).get('q') ?? ''
  if (input.value) search()
  else input.focus()
}

function pageItem(page, root, strings) {
  const link = element('a', { href: address(root, page.path) }, ...pageTitle(page, strings))
  const lead = page.hits.find(({ anchor }) => anchor === '')
  const places = page.hits.filter(({ anchor }) => anchor !== '')
  return element(
    'li',
    {},
    element('h2', { class: 'found-title' }, link),
    lead ? element('p', {}, ...hitParts(lead)) : null,
    places.length > 0 ? element('ul', {}, ...places.map((hit) => placeItem(hit, page.path, root))) : null,
  )
}

function placeItem(hit, path, root) {
  const [trail, ...rest] = hitParts(hit)
  return element('li', {}, element('a', { href: address(root, path, hit.anchor) }, trail), ...rest)
}
