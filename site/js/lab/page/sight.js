/** Whether an element can be seen: in the window, and the window's tab in front. */

/**
 * Call `changed(true or false)` when that changes, and once at first.
 *
 * @returns {() => void} stops it
 */
export function watchSight(element, changed) {
  let seen = false
  const tell = () => changed(seen && !document.hidden)
  const observer = new IntersectionObserver((entries) => {
    seen = entries[entries.length - 1].isIntersecting
    tell()
  })
  observer.observe(element)
  document.addEventListener('visibilitychange', tell)
  return () => {
    observer.disconnect()
    document.removeEventListener('visibilitychange', tell)
  }
}
