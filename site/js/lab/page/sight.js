/** Watches whether an element is visible: in the window, and the window's tab in front. */

/**
 * Call `callback(true or false)` when that changes, and once at first.
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
