/** What a reader wishes, and what is seen of the page. */

/** Whether the reader wants nothing to move by itself. */
export const prefersStillness = () => window.matchMedia('(prefers-reduced-motion: reduce)').matches

/**
 * Call `callback(isVisible)` when that changes, and once at first: whether an element is in the window, and its tab in front.
 *
 * @returns {() => void} stops it
 */
export function watchSight(element, callback) {
  let isIntersecting = false
  const tell = () => callback(isIntersecting && !document.hidden)
  const observer = new IntersectionObserver((entries) => {
    isIntersecting = entries[entries.length - 1].isIntersecting
    tell()
  })
  observer.observe(element)
  document.addEventListener('visibilitychange', tell)
  return () => {
    observer.disconnect()
    document.removeEventListener('visibilitychange', tell)
  }
}
