/** The search page: a form, and below it the results as a list. */

import { h } from '../lab/page/dom.js'
import { readWords } from '../page/words.js'
import { noteQuery } from './recent.js'
import { address, hitParts, pageTitle, summary } from './view.js'

const STEP = 15 // pages at a time
const WAIT = 200 // ms after the last key

/** Mount the form; a query in the address is searched at once. */
export async function mountPage(context) {
  const form = document.querySelector('[data-search-form]')
  const input = form.querySelector('input')
  const place = document.querySelector('[data-search-results]')
  const status = h('p', { class: 'search-status', role: 'status' })
  const list = h('ol', { class: 'found-pages' })
  const moreButton = h('button', { type: 'button', class: 'search-more', hidden: true })
  place.replaceChildren(status, list, moreButton)
  let lastRequest = 0
  let limit = STEP
  let timer = 0

  const search = async ({ keep = false } = {}) => {
    const query = input.value.trim()
    const request = ++lastRequest
    if (!keep) limit = STEP
    if (query === '') return show(null, query)
    try {
      const [result, listing] = [await context.find(query, limit), await context.listing()]
      if (request === lastRequest) show(result, query, listing.strings)
    } catch {
      if (request === lastRequest) status.textContent = readWords(document)('search.failed')
    }
  }

  const show = (result, query, strings) => {
    status.textContent = result ? summary(result, strings) + (result.count === 0 ? ` ${strings.advice}` : '') : ''
    list.replaceChildren(...(result?.pages ?? []).map((page) => pageItem(page, context.root, strings)))
    moreButton.hidden = !result || result.count <= limit
    moreButton.textContent = strings?.more ?? ''
    history.replaceState(history.state, '', query ? `?q=${encodeURIComponent(query)}` : location.pathname)
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
  moreButton.addEventListener('click', async () => {
    const count = list.children.length
    limit += STEP
    await search({ keep: true })
    list.children[count]?.querySelector('a').focus()
  })
  input.value = new URLSearchParams(location.search).get('q') ?? ''
  if (input.value) search()
  else input.focus()
}

function pageItem(page, root, strings) {
  const link = h('a', { href: address(root, page.path) }, ...pageTitle(page, strings))
  const lead = page.hits.find(({ anchor }) => anchor === '')
  const places = page.hits.filter(({ anchor }) => anchor !== '')
  return h(
    'li',
    {},
    h('h2', { class: 'found-title' }, link),
    lead ? h('p', {}, ...hitParts(lead)) : null,
    places.length > 0 ? h('ul', {}, ...places.map((hit) => placeItem(hit, page.path, root))) : null,
  )
}

function placeItem(hit, path, root) {
  const [trail, ...rest] = hitParts(hit)
  return h('li', {}, h('a', { href: address(root, path, hit.anchor) }, trail), ...rest)
}
