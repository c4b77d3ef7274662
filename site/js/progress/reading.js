/**
 * When a lesson counts as read: a judgement that the reader can correct.
 *
 * The text is taken in a hundred parts. A part is seen once it was in the window for two seconds. The lesson counts as read when its
 * end and four fifths of it are seen, after ten seconds at least: who follows a link to its end has not read it, nor who scrolls
 * through. Parts seen on an earlier visit count again.
 */

const PARTS = 100
const LOOKS = 2
const LEAST = 10
const ENOUGH = 0.8

/** How much of a text was in sight. */
export class Reading {
  #looks = new Uint8Array(PARTS)
  #total = 0

  /** @param {number} before the share that was seen on earlier visits, taken from the beginning */
  constructor(before = 0) {
    this.#looks.fill(LOOKS, 0, Math.floor(before * PARTS))
  }

  /** A second passes while the text is in the window from one share of its height to another. */
  look(from, to) {
    const [first, end] = [Math.max(0, Math.floor(from * PARTS)), Math.min(PARTS, Math.ceil(to * PARTS))]
    if (!(first < end)) return
    this.#total += 1
    for (let part = first; part < end; part++) this.#looks[part] = Math.min(LOOKS, this.#looks[part] + 1)
  }

  /** The share that was seen. */
  get share() {
    return this.#looks.reduce((sum, looks) => sum + Number(looks === LOOKS), 0) / PARTS
  }

  /** So many seconds the text was in sight, on this visit. */
  get seconds() {
    return this.#total
  }

  get isRead() {
    return this.#total >= LEAST && this.#looks[PARTS - 1] === LOOKS && this.share >= ENOUGH
  }
}
