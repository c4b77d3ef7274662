/**
 * Links to lines of listings. Every line has an anchor in the page itself; this script adds the line numbers, which put a link
 * into the address bar, and links to several lines at once (`#l4_2_inertia.L12-L20`).
 *
 * The numbers of a listing are one control, for arrow keys and the mouse; with Shift it marks a range. Screen readers announce the
 * marked line instead of all numbers.
 */

import { h } from '../lab/page/dom.js'
import { decode, unfold } from './unfold.js'
import { selectAll } from './select.js'

const LINES = /^#?(.+)\.L([1-9]\d{0,8})(?:-L([1-9]\d{0,8}))?$/

/** The lines that an address names: `{stem, first, last}`, or null. */
export function readLines(hash) {
  const [, stem, first, last = first] = LINES.exec(decode(hash)) ?? []
  return stem && Number(first) <= Number(last) ? { stem, first: Number(first), last: Number(last) } : null
}

/** The fragment of an address for lines in either order. */
export function writeLines(stem, anchor, end) {
  const [first, last] = anchor < end ? [anchor, end] : [end, anchor]
  return `#${encodeURI(stem)}.L${first}` + (last > first ? `-L${last}` : '')
}

/** The number of the line at height `y` in a column of lines of equal height. */
export function lineAt(y, height, first, count) {
  const line = first + Math.floor((y / height) * count)
  return Math.min(Math.max(line, first), first + count - 1)
}

/** Mark the lines of an address and open the folds around them; returns the marked elements. */
function mark(document, lines) {
  for (const old of document.querySelectorAll('.marked')) old.classList.remove('marked')
  const elements = []
  for (let n = lines?.first; n <= lines?.last; n++) {
    const line = document.getElementById(`${lines.stem}.L${n}`)
    if (!line) break
    line.classList.add('marked')
    unfold(line)
    elements.push(line)
  }
  return elements
}

/** Scroll to a line and to its beginning, as the browser would show the end of a long one. */
function show(line, block) {
  if (!line) return
  line.scrollIntoView({ block })
  scrollToStart(line)
}

function scrollToStart(line) {
  if (line) line.closest('pre').scrollLeft = 0
}

/** Follow the page's address: mark the lines that it names, now and whenever it changes. */
export function followLines(window) {
  const follow = () => show(mark(window.document, readLines(window.location.hash))[0], 'center')
  window.addEventListener('hashchange', follow)
  if (!readLines(window.location.hash)) return
  follow()
  // By then the browser has scrolled to the line by itself, and perhaps to its end.
  window.addEventListener('load', () => scrollToStart(window.document.querySelector('.marked')))
}

/** Put line numbers beside the listings of a part of the page, replacing old ones. */
export function addLineNumbers(part, words) {
  for (const box of selectAll(part, 'pre[data-first]')) {
    box.querySelector(':scope > .lines')?.remove()
    const line = box.querySelector('code > [id]')
    if (line) box.prepend(makeColumn(box, line, words))
  }
}

function makeColumn(box, line, words) {
  const first = Number(box.dataset.first)
  const count = box.querySelectorAll('code > [id]').length
  const { stem } = readLines(line.id)
  const numbers = Array.from({ length: count }, (_, n) => first + n).join('\n')
  const range = { 'aria-valuemin': first, 'aria-valuemax': first + count - 1, 'aria-valuenow': first }
  const names = { role: 'slider', 'aria-orientation': 'vertical', 'aria-label': words('code.mark') }
  const column = h('span', { class: 'lines', tabIndex: 0, ...names, ...range }, numbers)
  let anchor = first
  let end = first
  const select = (next, extend) => {
    end = Math.min(Math.max(next, first), first + count - 1)
    if (!extend) anchor = end
    const hash = writeLines(stem, anchor, end)
    history.replaceState(history.state, '', hash)
    const elements = mark(box.ownerDocument, readLines(hash))
    column.setAttribute('aria-valuenow', end)
    column.setAttribute('aria-valuetext', anchor === end ? `${end}` : `${Math.min(anchor, end)}–${Math.max(anchor, end)}`)
    return elements[end < anchor ? 0 : elements.length - 1]
  }
  column.addEventListener('click', (event) => {
    const { top, height } = column.getBoundingClientRect()
    select(lineAt(event.clientY - top, height, first, count), event.shiftKey)
  })
  column.addEventListener('keydown', (event) => {
    const keys = { ArrowDown: end + 1, ArrowRight: end + 1, ArrowUp: end - 1, ArrowLeft: end - 1, Home: first, End: first + count - 1 }
    if (!(event.key in keys) || event.ctrlKey || event.altKey || event.metaKey) return
    event.preventDefault()
    show(select(keys[event.key], event.shiftKey), 'nearest')
  })
  return column
}
