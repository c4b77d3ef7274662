/** What a browser must have for a lab, and what to say where it has not. */

/**
 * What is missing for a lab to run at all. Missing WebGL is noticed when the picture begins, an old browser's worker when it starts.
 *
 * @returns {string | null} the key of the word that says it
 */
export function missing() {
  if (typeof WebAssembly !== 'object') return 'lab.live.no_wasm'
  if (typeof Worker !== 'function') return 'lab.live.no_worker'
  return null
}

/** Whether the reader has asked for nothing to move by itself. */
export const prefersStillness = () => window.matchMedia('(prefers-reduced-motion: reduce)').matches
