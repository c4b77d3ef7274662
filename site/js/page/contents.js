/** Marks the section that is being read in the contents list, and opens the list where there is room for it. */

/** The index of the last heading at or above `line` (px from the top of the window); -1 above the first. */
export function currentHeading(tops, line) {
  let low = 0
  let high = tops.length
  while (low < high) {
    const middle = (low + high) >> 1
    if (tops[middle] <= line) low = middle + 1
    else high = middle
  }
  return low - 1
}

/** Gives a function that ends it. */
export function followContents(document) {
  const links = [...document.querySelectorAll('.toc a[href^="#"]')]
  const pairs = links
    .map((link) => ({ link, heading: document.getElementById(decodeURIComponent(link.hash.slice(1))) }))
    .filter(({ heading }) => heading)
  if (pairs.length === 0) return () => {}
  let marked = null
  let waiting = false
  const mark = () => {
    waiting = false
    const atEnd = innerHeight + scrollY >= document.documentElement.scrollHeight - 2
    const tops = pairs.map(({ heading }) => heading.getBoundingClientRect().top)
    const index = atEnd && scrollY > 0 ? lastVisible(tops) : currentHeading(tops, innerHeight * 0.25)
    const link = pairs[index]?.link ?? null
    if (link === marked) return
    marked?.removeAttribute('aria-current')
    link?.setAttribute('aria-current', 'location')
    marked = link
  }
  const later = () => {
    if (!waiting) requestAnimationFrame(mark)
    waiting = true
  }
  const ended = new AbortController()
  addEventListener('scroll', later, { passive: true, signal: ended.signal })
  addEventListener('resize', later, { signal: ended.signal })
  mark()
  return () => {
    ended.abort()
    marked?.removeAttribute('aria-current')
  }
}

/** At the end of a page the last heading in sight counts, however low it stands. */
function lastVisible(tops) {
  return currentHeading(tops, innerHeight)
}
