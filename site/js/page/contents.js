/** Marks the current section in the list of contents, and keeps it in sight if the list scrolls. */

/** The index of the last heading at or above `line` (px from the top of the window); -1 above the first. */
export const currentHeading = (tops, line) => tops.findLastIndex((top) => top <= line)

/**
 * How far a list that scrolls must move so that an entry is in sight, with room for one more on either side.
 * @param {{top: number, bottom: number}} list its edges, in px
 * @param {{top: number, bottom: number}} entry
 * @returns {number} px; 0 if the entry is in sight
 */
export function listMove(list, entry) {
  const room = Math.min(entry.bottom - entry.top, (list.bottom - list.top - entry.bottom + entry.top) / 2)
  if (entry.top < list.top + room) return entry.top - list.top - room
  if (entry.bottom > list.bottom - room) return entry.bottom - list.bottom + room
  return 0
}

/**
 * Follow the reader's scrolling, and unfold the lists where they stand beside the text. (Style sheets show them there even if they
 * are folded, but a tool that asks what can be reached believes the fold.) On other screens hard cases behind the first of their
 * family are folded: a page of eight would be long. Returns a function that ends it.
 */
export function followContents(document) {
  const page = document.querySelector('.level-nav [aria-current="page"]')
  if (page) keepInSight(page, page)
  const links = [...document.querySelectorAll('.toc a[href^="#"]')]
  const pairs = links
    .map((link) => ({ link, heading: document.getElementById(decodeURIComponent(link.hash.slice(1))) }))
    .filter(({ heading }) => heading)
  const abort = new AbortController()
  const wide = matchMedia('(width >= 75rem)')
  const open = () => {
    for (const fold of document.querySelectorAll('.beside details, details.case + details.case')) fold.open = wide.matches
  }
  open()
  wide.addEventListener('change', open, { signal: abort.signal })
  if (pairs.length === 0) return () => abort.abort()
  let current = null
  const mark = () => {
    // At the end of a page the last heading in sight counts, however low it stands.
    const atEnd = scrollY > 0 && innerHeight + scrollY >= document.documentElement.scrollHeight - 2
    const tops = pairs.map(({ heading }) => heading.getBoundingClientRect().top)
    const link = pairs[currentHeading(tops, innerHeight * (atEnd ? 1 : 0.25))]?.link ?? null
    if (link === current) return
    current?.removeAttribute('aria-current')
    link?.setAttribute('aria-current', 'location')
    current = link
    keepInSight(link, links[0])
  }
  // Browsers send one of these events for each picture at most.
  addEventListener('scroll', mark, { passive: true, signal: abort.signal })
  addEventListener('resize', mark, { signal: abort.signal })
  mark()
  return () => {
    abort.abort()
    current?.removeAttribute('aria-current')
  }
}

/** Scroll a long list to its entry, unless somebody is going through it by keyboard. */
function keepInSight(link, anyLink) {
  const list = anyLink.closest('.toc, .level-nav')
  if (list.scrollHeight <= list.clientHeight || list.querySelector(':focus-visible')) return
  if (link) list.scrollTop += listMove(list.getBoundingClientRect(), link.getBoundingClientRect())
  else list.scrollTop = 0
}
