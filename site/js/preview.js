/**
 * The preview's script: updates the page when the author saves, and shows mistakes.
 *
 * Served by `coursebuild serve` only; a published site does not have it. It runs before the page's other scripts, while the page is
 * still as the server sent it.
 */

import { h } from './lab/page/dom.js'
import { holdPlace } from './page/place.js'
import { Marks } from './preview/marks.js'
import { Panel } from './preview/panel.js'
import { setClock } from './preview/times.js'
import { Twin } from './preview/twin.js'
import { say } from './page/words.js'

const AGAIN = 1000 // ms

const script = document.currentScript
const page = script.dataset.page
const texts = JSON.parse(script.dataset.words)
const sayHere = (key, values) => say((name) => texts[name] ?? name, `preview.${key}`, values)
const parse = (text) => new DOMParser().parseFromString(text, 'text/html')
/** What a page needs that only loading it gives: its scripts, and the policy of exercises. */
const needs = (page) => {
  const sources = [...page.querySelectorAll('head script[src]')].map((script) => script.getAttribute('src'))
  return [...sources, page.querySelector('[data-exercise]') !== null].join('\n')
}
const sheet = (page) => page.querySelector('head link[rel="stylesheet"]')
const stateOf = (next) => next.querySelector('script[data-state]')?.dataset.state ?? ''

let state = script.dataset.state // of the page on screen
let target = state // of the page that the server has
let isTaking = false
let tool = null
let latestNews = null
let head = document.cloneNode(true)
const twin = new Twin(document.body)
const accept = (id) => ask('accept', { page, id })
const panel = new Panel(sayHere, (place) => ask('open', { place }), accept)
const marks = new Marks(sayHere, accept)

/** Bring the page to the server's state, again and again while that changes. */
async function take() {
  if (isTaking) return
  isTaking = true
  try {
    while (target !== state && target !== '') {
      const response = await fetch(location.href, { cache: 'no-store' })
      const next = parse(await response.text())
      const fresh = stateOf(next)
      if (state === '' || needs(head) !== needs(next)) return location.reload()
      if (fresh === '') break // the page is gone again; a message will follow
      change(next)
      state = fresh
      if (target !== fresh) await new Promise((resolve) => setTimeout(resolve, 20))
    }
  } catch {
    // The server has stopped; it sends its state when it is back.
  } finally {
    isTaking = false
  }
}

function change(next) {
  const keep = holdPlace()
  takeHead(next)
  const nodes = twin.update(next.body)
  head = next
  document.dispatchEvent(new CustomEvent('coursebuild:changed', { detail: nodes }))
  if (latestNews !== null) marks.show(latestNews)
  keep()
}

/** Ask the server to do something; returns why it did not, or nothing. */
async function ask(command, values) {
  try {
    const response = await fetch(`/.coursebuild/${command}`, { method: 'POST', body: JSON.stringify(values) })
    return (await response.json()).message
  } catch {
    return sayHere('silent')
  }
}

/** Take over a new page's title, language and style sheet. Its scripts cannot be taken over. */
function takeHead(next) {
  document.title = next.title
  document.documentElement.lang = next.documentElement.lang
  takeSheet(sheet(next)?.getAttribute('href'))
}

/** Replace the style sheet once the new one and its fonts are loaded, so that nothing flashes. */
async function takeSheet(address) {
  const old = sheet(document)
  if (!address || !old || old.dataset.next === address) return
  if (!old.dataset.next && old.getAttribute('href') === address) return
  old.dataset.next = address
  await loadFonts(new URL(address, document.baseURI)).catch(() => {})
  if (old.dataset.next !== address) return // there is a newer one
  const fresh = h('link', { rel: 'stylesheet', href: address, onload: () => old.remove(), onerror: () => fresh.remove() })
  old.after(fresh)
}

async function loadFonts(address) {
  const text = await (await fetch(address)).text()
  const fonts = [...text.matchAll(/url\(["']?([^"')]+\.woff2)["']?\)/g)].map(([, file]) => new URL(file, address))
  await Promise.all(fonts.map(async (font) => (await fetch(font)).arrayBuffer()))
}

/**
 * Listen to the server, which sends its whole state whenever a page connects; not while the page is hidden, as browsers allow few
 * connections to one host.
 */
function connect(page, handlers) {
  let source = null
  let timer = null
  const close = () => {
    clearTimeout(timer)
    source?.close()
    source = null
  }
  const open = () => {
    if (source !== null || document.visibilityState === 'hidden') return
    source = new EventSource(`/.coursebuild/events?page=${encodeURIComponent(page)}`)
    for (const name of ['hello', 'page', 'news']) {
      source.addEventListener(name, (event) => handlers[name](JSON.parse(event.data)))
    }
    source.addEventListener('error', () => {
      handlers.lost()
      close()
      timer = setTimeout(open, AGAIN)
    })
  }
  document.addEventListener('visibilitychange', () => (document.visibilityState === 'hidden' ? close() : open()))
  window.addEventListener('pagehide', close)
  window.addEventListener('pageshow', open)
  open()
}

connect(page, {
  hello(greeting) {
    if (tool !== null && tool !== greeting.tool) location.reload() // another version of the preview itself
    tool = greeting.tool
    setClock(greeting.now)
    panel.setState({ lost: false, folder: greeting.folder })
  },
  page(newState) {
    target = newState
    panel.setState({ gone: newState === '' && state !== '' })
    take()
  },
  news(news) {
    latestNews = news
    panel.show(news)
    const keep = holdPlace()
    marks.show(news)
    keep()
  },
  lost: () => panel.setState({ lost: true }),
})
