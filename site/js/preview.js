/**
 * The preview's part of a page: brings what the author saved into it, and shows what is wrong.
 *
 * Served by `coursebuild serve` only; a published site does not have it. It runs before the page's other scripts, while the page is
 * still what the server sent.
 */

import { connect } from './preview/connection.js'
import { needsLoad, takeHead } from './preview/head.js'
import { Marks } from './preview/marks.js'
import { Panel } from './preview/panel.js'
import { holdPlace } from './preview/place.js'
import { Twin } from './preview/twin.js'
import { dismissWorkers } from './preview/workers.js'

const own = document.currentScript
const page = own.dataset.page
const parse = (text) => new DOMParser().parseFromString(text, 'text/html')
const stateOf = (next) => next.querySelector('script[data-state]')?.dataset.state ?? ''

let state = own.dataset.state // of the page that is shown
let wanted = state
let taking = false
let tool = null
let latest = null // news
let head = document.cloneNode(true)
const twin = new Twin(document.body)
const panel = new Panel((place) => ask('open', { place }))
const marks = new Marks((id) => ask('accept', { page, id }))

/** Bring the page to the state that the server has, as often as that is another one by then. */
async function take() {
  if (taking) return
  taking = true
  try {
    while (wanted !== state && wanted !== '') {
      const response = await fetch(location.href, { cache: 'no-store' })
      const next = parse(await response.text())
      const fresh = stateOf(next)
      if (state === '' || needsLoad(head, next)) return location.reload()
      if (fresh === '') break // it is gone again; that will be told
      change(next)
      state = fresh
      if (wanted !== fresh) await new Promise((again) => setTimeout(again, 20))
    }
  } catch {
    // The server has gone; what is new is told when it is back.
  } finally {
    taking = false
  }
}

function change(next) {
  const keep = holdPlace()
  takeHead(next)
  const changed = twin.update(next.body)
  head = next
  document.dispatchEvent(new CustomEvent('coursebuild:changed', { detail: changed }))
  if (latest !== null) marks.show(latest)
  keep()
}

/** Ask the preview to do something; gives why it did not, or nothing. */
async function ask(what, values) {
  try {
    const response = await fetch(`/.coursebuild/${what}`, { method: 'POST', body: JSON.stringify(values) })
    return (await response.json()).message
  } catch {
    return 'the preview does not answer'
  }
}

dismissWorkers(navigator).catch(() => {}) // a browser may keep them from pages

connect(page, {
  hello(told) {
    if (tool !== null && tool !== told.tool) location.reload() // another version of the preview itself
    tool = told.tool
    panel.state({ lost: false })
  },
  page(now) {
    wanted = now
    panel.state({ gone: now === '' && state !== '' })
    take()
  },
  news(told) {
    latest = told
    panel.show(told)
    const keep = holdPlace()
    marks.show(told)
    keep()
  },
  lost: () => panel.state({ lost: true }),
})
