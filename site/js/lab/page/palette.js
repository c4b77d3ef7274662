/** The page's colours for canvases, to which style sheets do not apply, and a watcher of their changes. */

/** Resolve a CSS colour, as it applies inside an element, to `rgb(…)`. */
export function resolve(element, colour) {
  const probe = document.createElement('span')
  probe.hidden = true
  probe.style.color = colour
  element.append(probe)
  const text = getComputedStyle(probe).color
  probe.remove()
  return text
}

/** A CSS colour `rgb(r g b)` as numbers in [0, 1]. */
export function channels(text) {
  const numbers = text.match(/[\d.]+/g).map(Number)
  return numbers.slice(0, 3).map((x) => x / 255)
}

/**
 * Call `callback` when the page changes between light and dark.
 *
 * @returns {() => void} stops it
 */
export function watchTheme(callback) {
  const media = window.matchMedia('(prefers-color-scheme: dark)')
  const observer = new MutationObserver(callback)
  observer.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] })
  media.addEventListener('change', callback)
  return () => {
    observer.disconnect()
    media.removeEventListener('change', callback)
  }
}
