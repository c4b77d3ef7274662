/**
 * Footnotes beside their marks, where the window has a margin. They stay where they are in the page, a list at its end,
 * and are only shown elsewhere: each is there once, and on paper they are at the end.
 *
 * A note stands at the height of its first mark, or below what is in its way: the note before it, and what takes the
 * margin as well. One that would come to stand far from its mark, or whose mark is folded away, is left at the end.
 */

const WIDE = '(width >= 75rem)'
const GAP = 14 // px between notes
const FAR = 700 // px from a mark to its note

/**
 * Heights at which notes stand, in px.
 *
 * @param {{mark: number | null, height: number}[]} notes in their order; a mark is null where it is not seen
 * @param {{top: number, bottom: number}[]} taken stretches of the margin, from the top
 * @param {number} end of the margin
 * @returns {(number | null)[]} null for a note that finds no place
 */
export function noteTops(notes, taken, end) {
  let free = -Infinity
  return notes.map(({ mark, height }) => {
    if (mark === null) return null
    let top = below(Math.max(mark, free), height, taken)
    if (top + height > end) {
      const higher = end - height // the last may begin above its mark
      top = higher >= Math.max(free, 0) && below(higher, height, taken) === higher ? higher : null
    }
    if (top === null || Math.abs(top - mark) > FAR) return null
    free = top + height + GAP
    return top
  })
}

/** The first height from `top` on at which nothing is in the way. */
function below(top, height, taken) {
  for (const stretch of taken) {
    if (stretch.top < top + height + GAP && top < stretch.bottom + GAP) top = stretch.bottom + GAP
  }
  return top
}

/** Keep the notes of a page beside their marks; gives a function that ends it. */
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
  const tops = noteTops(sizes, stretches(prose, list, notes[0]), list.getBoundingClientRect().top - origin)
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

/** What reaches into the margin, from the top. */
function stretches(prose, list, note) {
  const origin = prose.getBoundingClientRect().top
  const { left, right } = note.getBoundingClientRect()
  const boxes = [...prose.querySelectorAll('.prose > :not(.further), .formula')].filter((box) => box !== list)
  return boxes
    .map((box) => box.getBoundingClientRect())
    .filter((box) => box.height > 0 && box.left < right && box.right > left)
    .map(({ top, bottom }) => ({ top: top - origin, bottom: bottom - origin }))
    .sort((a, b) => a.top - b.top)
}
