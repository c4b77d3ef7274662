/** Checks what a browser has. */

/**
 * The feature that the browser lacks to run labs. A lack of WebGL or of workers with modules is noticed only when they start.
 *
 * @returns {string | null} the key of the message
 */
export function missingFeature() {
  if (typeof WebAssembly !== 'object') return 'lab.live.no_wasm'
  if (typeof Worker !== 'function') return 'lab.live.no_worker'
  return null
}

/** Whether the reader wants nothing to move by itself. */
export const prefersStillness = () => window.matchMedia('(prefers-reduced-motion: reduce)').matches
