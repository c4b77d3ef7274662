/**
 * Links to lines of listings. Every line has an anchor in the page itself; here come the numbers beside the code, which
 * put a link into the address bar, and links to several lines at once (`#l4_2_inertia.L12-L20`).
 *
 * The numbers of a piece of code are one control, moved by arrow keys or pointed at; with Shift it marks a range. What
 * is read out is the line that is marked and not one number after the other.
 */

import { decoded, unfold } from './unfold.js'
import { within } from './within.js'

const LINES = /^#?(.+)\.L([1-9]\d{0,8})(?:-L([1-9]\d{0,8}))?$/

/** The lines that an address names: `{stem, first, last}`; null where it names something else. */
export function readLines(hash) {
  const [, stem, first, last = first] = LINES.exec(decoded(hash)) ?? []
  return stem && Number(first) <= Number(last) ? { stem, first: Number(first), last: Number(last) } : null
}

/** The fragment of an address for lines in either order. */
export function writeLines(stem, from, to) {
  const [first, last] = from < to ? [from, to] : [to, from]
  return `#${encodeURI(stem)}.L${first}` + (last > first ? `-L${last}` : '')
}

/** The number of the line at a height of a column of lines that are equally high. */
export function lineAt(y, height, first, count) {
  const line = first + Math.floor((y / height) * count)
  return Math.min(Math.max(line, first), first + count - 1)
}

/** Mark the lines of an address and open what they are folded in. Gives the marked elements. */
function mark(document, lines) {
  for (const old of document.querySelectorAll('.marked')) old.classList.remove('marked')
  const found = []
  for (let n = lines?.first; n <= lines?.last; n++) {
    const line = document.getElementById(`${lines.stem}.L${n}`)
    if (!line) break
    line.classList.add('marked')
    unfold(line)
    line.closest('[hidden]')?.dispatchEvent(new Event('beforematch'))
    found.push(line)
  }
  return found
}

/** Bring a line into sight, with its beginning: a long one would be scrolled to its end. */
function show(line, block) {
  if (!line) return
  line.scrollIntoView({ block })
  straighten(line)
}

function straighten(line) {
  if (line) line.closest('pre').scrollLeft = 0
}

/** Follow the page's address: mark the lines that it names, now and whenever it changes. */
export function followLines(window) {
  const follow = () => show(mark(window.document, readLines(window.location.hash))[0], 'center')
  window.addEventListener('hashchange', follow)
  if (!readLines(window.location.hash)) return
  follow()
  // By then the browser has gone to the line by itself, and perhaps to its end.
  window.addEventListener('load', () => straighten(window.document.querySelector('.marked')))
}

/** Put numbers beside the listings of a part of the page, in place of those that are there. */
export function addLineNumbers(part, words) {
  for (const box of within(part, 'pre[data-first]')) {
    box.querySelector(':scope > .lines')?.remove()
    const line = box.querySelector('code > [id]')
    if (line) box.prepend(numbers(box, line, words))
  }
}

function numbers(box, line, words) {
  const first = Number(box.dataset.first)
  const count = box.querySelectorAll('code > [id]').length
  const { stem } = readLines(line.id)
  const column = box.ownerDocument.createElement('span')
  column.className = 'lines'
  column.textContent = Array.from({ length: count }, (_, n) => first + n).join('\n')
  const values = { role: 'slider', 'aria-orientation': 'vertical', 'aria-label': words('code.mark') }
  const range = { 'aria-valuemin': first, 'aria-valuemax': first + count - 1, 'aria-valuenow': first }
  for (const [name, value] of Object.entries({ tabindex: 0, ...values, ...range })) column.setAttribute(name, value)
  let from = first
  let to = first
  const go = (next, extend) => {
    to = Math.min(Math.max(next, first), first + count - 1)
    if (!extend) from = to
    const hash = writeLines(stem, from, to)
    history.replaceState(history.state, '', hash)
    const found = mark(box.ownerDocument, readLines(hash))
    column.setAttribute('aria-valuenow', to)
    column.setAttribute('aria-valuetext', from === to ? `${to}` : `${Math.min(from, to)}–${Math.max(from, to)}`)
    return found[to < from ? 0 : found.length - 1]
  }
  column.addEventListener('click', (event) => {
    const { top, height } = column.getBoundingClientRect()
    go(lineAt(event.clientY - top, height, first, count), event.shiftKey)
  })
  column.addEventListener('keydown', (event) => {
    const keys = { ArrowDown: to + 1, ArrowRight: to + 1, ArrowUp: to - 1, ArrowLeft: to - 1, Home: first, End: first + count - 1 }
    if (!(event.key in keys) || event.ctrlKey || event.altKey || event.metaKey) return
    event.preventDefault()
    show(go(keys[event.key], event.shiftKey), 'nearest')
  })
  return column
}
