/**
 * The script of a lesson as slides: one slide at a time, keys, and the labs and quizzes on them. Without it all slides stand one below
 * the other, and labs are their recorded pictures.
 *
 * The page is one file and loads nothing. What labs need is in it, compressed, and becomes `data:` addresses when the page is opened:
 * in a page from disk, workers can fetch no others.
 */

import { h } from './lab/page/dom.js'
import { linkedLab, loadLabs } from './page/labs.js'
import { mountQuizzes } from './page/quizzes.js'
import { markScrolling } from './page/scroll.js'
import { decode, unfold } from './page/unfold.js'
import { readWords } from './page/words.js'
import { openProgress } from './progress/store.js'

const NEXT = ['PageDown', ' ']
const PREVIOUS = ['PageUp']
/** What uses these keys itself. */
const OWN_KEYS = 'input, select, textarea, [contenteditable], [role="slider"], [role="application"], .lab-live, .question'
const PRESSED = 'a, button, summary, [role="button"]'

const words = readWords(document)
const slides = [...document.querySelectorAll('.slide')]
const isRightToLeft = document.documentElement.dir === 'rtl'
const counter = h('span')
const [back, on] = ['previous', 'next'].map((name) => h('button', { type: 'button', class: `slides-${name}`, 'aria-label': words(`slides.${name}`) }))
let current = -1

/** Show a slide, and move the focus to it, so that it is read aloud. */
function show(index, { focus = true } = {}) {
  const place = Math.max(0, Math.min(index, slides.length - 1))
  if (place === current) return
  current = place
  slides.forEach((slide, n) => slide.classList.toggle('slide-shown', n === place))
  counter.textContent = `${place + 1} / ${slides.length}`
  back.disabled = place === 0
  on.disabled = place === slides.length - 1
  window.scrollTo(0, 0)
  if (focus) slides[place].focus({ preventScroll: true })
}

/** Go to a slide, whose address the page then has. */
function go(index) {
  show(index)
  history.replaceState(null, '', `#${slides[current].id}`)
}

/** Show the slide to which the address leads: to itself, to something on it, or to the state of a lab. */
function follow() {
  const fragment = decode(location.hash.slice(1))
  const lab = linkedLab(location.hash)
  const target = lab === null ? document.getElementById(fragment) : document.querySelector(`[data-lab="${CSS.escape(lab)}"]`)
  const index = slides.indexOf(target?.closest('.slide'))
  show(index < 0 ? Math.max(0, current) : index, { focus: current >= 0 })
  if (index < 0 || target === slides[index]) return
  unfold(target)
  target.scrollIntoView()
}

/** Whether there is more to see of the slide in the direction of a key; then the key scrolls. */
function hasMore(isForward) {
  const { scrollTop, clientHeight, scrollHeight } = document.documentElement
  return isForward ? scrollTop + clientHeight < scrollHeight - 2 : scrollTop > 2
}

function scrollsSideways(element) {
  const box = element.closest('[data-more]')
  return box !== null && box.contains(document.activeElement)
}

function press(event) {
  if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey || event.target.closest(OWN_KEYS)) return
  const { key, shiftKey, target } = event
  let step = 0
  if (key === 'ArrowRight' || key === 'ArrowLeft') {
    if (shiftKey || scrollsSideways(target)) return
    step = (key === 'ArrowRight') === isRightToLeft ? -1 : 1
  } else if (NEXT.includes(key) || PREVIOUS.includes(key)) {
    if (key === ' ' && target.closest(PRESSED)) return
    step = PREVIOUS.includes(key) || shiftKey ? -1 : 1
    if (hasMore(step > 0)) return
  } else if (key === 'Home' || key === 'End') {
    step = key === 'Home' ? -slides.length : slides.length
  } else return
  event.preventDefault()
  go(current + step)
}

/** The bytes of a file in the page, unpacked. */
async function unpack(element) {
  const bytes = /** @type {any} */ (Uint8Array).fromBase64(element.textContent)
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))
  return new Uint8Array(await new Response(stream).arrayBuffer())
}

/** @param {Uint8Array} bytes @param {string} type */
const addressOf = (bytes, type) => `data:${type};base64,${/** @type {any} */ (bytes).toBase64()}`

/** Give the files in the page addresses, and put these where their paths stand. */
async function openFiles() {
  const files = new Map()
  const addresses = new Map()
  for (const element of document.querySelectorAll('body > script[data-file]')) {
    const { file, type } = element.dataset
    files.set(file, await unpack(element))
    addresses.set(file, addressOf(files.get(file), type))
  }
  const address = (path) => addresses.get(path) ?? path
  for (const lab of document.querySelectorAll('[data-lab][data-config]')) {
    const config = JSON.parse(new TextDecoder().decode(files.get(lab.dataset.config)))
    for (const name of ['module', 'mjb', 'worker', 'wasm']) if (config[name]) config[name] = address(config[name])
    lab.dataset.config = addressOf(new TextEncoder().encode(JSON.stringify(config)), 'application/json')
    lab.dataset.script = address(lab.dataset.script)
  }
  const table = document.getElementById('_words').dataset
  if (table.quizScript) table.quizScript = address(table.quizScript)
}

document.documentElement.classList.add('slides-live')
for (const slide of slides) {
  slide.tabIndex = -1
  // It is the only one on the page.
  slide.querySelector('.prose > :is(h2, h3):first-child')?.setAttribute('aria-level', '1')
}
back.addEventListener('click', () => go(current - 1))
on.addEventListener('click', () => go(current + 1))
document.body.append(h('nav', { class: 'slides-bar', 'aria-label': words('slides.label') }, back, counter, on))
follow()
window.addEventListener('hashchange', follow)
document.addEventListener('keydown', press)
markScrolling(document)
// What a reader answers is kept as long as the page is open: the next audience begins anew.
const progress = openProgress('', null)
openFiles().then(() => {
  loadLabs(document, words, progress)
  mountQuizzes(document, words, progress)
})
