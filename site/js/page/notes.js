/**
 * Footnotes beside their marks, if the window has a margin. In the document they stay a list at the end, which is where
 * they are printed; only their position changes.
 *
 * A note stands at the height of its first mark, or below what is in its way: the note before it, and other content in the
 * margin. A note that would stand far from its mark, or whose mark is folded away, is left at the end.
 */

const WIDE = '(width >= 75rem)'
const GAP = 14 // px between notes
const FAR = 700 // px from a mark to its note

/**
 * Heights at which notes stand, in px.
 *
 * @param {{mark: number | null, height: number}[]} notes in their order; a mark is null if it is not visible
 * @param {{top: number, bottom: number}[]} obstacles stretches of the margin, from the top
 * @param {number} end of the margin
 * @returns {(number | null)[]} null for a note that finds no place
 */
export function noteTops(notes, obstacles, end) {
  let nextFree = -Infinity
  return notes.map(({ mark, height }) => {
    if (mark === null) return null
    let top = firstFreeTop(Math.max(mark, nextFree), height, obstacles)
    if (top + height > end) {
      const highest = end - height // the last may begin above its mark
      top = highest >= Math.max(nextFree, 0) && firstFreeTop(highest, height, obstacles) === highest ? highest : null
    }
    if (top === null || Math.abs(top - mark) > FAR) return null
    nextFree = top + height + GAP
    return top
  })
}

/** The first height from `top` on at which there is no obstacle. */
function firstFreeTop(top, height, obstacles) {
  for (const stretch of obstacles) {
    if (stretch.top < top + height + GAP && top < stretch.bottom + GAP) top = stretch.bottom + GAP
  }
  return top
}

/** Keep the notes of a page beside their marks; returns a function that ends it. */
export function placeNotes(document) {
  const list = document.querySelector('.prose > .footnotes')
  if (!list) return () => {}
  const prose = list.parentElement
  const wide = matchMedia(WIDE)
  const place = () => arrange(prose, list, wide.matches)
  const observer = new ResizeObserver(place)
  observer.observe(prose)
  wide.addEventListener('change', place)
  return () => {
    observer.disconnect()
    wide.removeEventListener('change', place)
  }
}

function arrange(prose, list, wide) {
  const notes = [...list.querySelectorAll(':scope > ol > li')]
  for (const note of notes) note.classList.toggle('aside', wide)
  list.classList.toggle('emptied', wide)
  if (!wide) return
  const origin = prose.getBoundingClientRect().top
  const sizes = notes.map((note) => ({ mark: heightOf(markOf(note), origin), height: note.offsetHeight }))
  const tops = noteTops(sizes, obstaclesOf(prose, list, notes[0], origin), list.getBoundingClientRect().top - origin)
  for (const [n, note] of notes.entries()) {
    note.classList.toggle('aside', tops[n] !== null)
    note.style.top = `${tops[n] ?? 0}px`
  }
  list.classList.toggle('emptied', !tops.includes(null))
}

const markOf = (note) => note.ownerDocument.getElementById(note.id.replace('fn:', 'fnref:'))

function heightOf(mark, origin) {
  const folded = mark?.closest('details:not([open]) > :not(summary), [hidden]')
  const box = folded ? null : mark?.getClientRects()[0]
  return box ? box.top - origin - 4 : null
}

/** The content that reaches into the margin, from the top. */
function obstaclesOf(prose, list, note, origin) {
  const { left, right } = note.getBoundingClientRect()
  const boxes = [...prose.querySelectorAll('.prose > :not(.further), .formula')].filter((box) => box !== list)
  return boxes
    .map((box) => box.getBoundingClientRect())
    .filter((box) => box.height > 0 && box.left < right && box.right > left)
    .map(({ top, bottom }) => ({ top: top - origin, bottom: bottom - origin }))
    .sort((a, b) => a.top - b.top)
}
