/**
 * Estimates whether a lesson has been read; the reader can correct it.
 *
 * The text is divided into a hundred parts. A part is seen once it was in the window for two seconds. The lesson counts as read when
 * its end and four fifths of it are seen, after at least ten seconds: following a link to its end, or scrolling through, is not
 * reading. Parts seen on an earlier visit count.
 */

const PARTS = 100
const LOOKS = 2
const LEAST = 10
const ENOUGH = 0.8

/** Measures how much of a text was in sight. */
export class Reading {
  #looks = new Uint8Array(PARTS)
  #total = 0

  /** @param {number} earlierShare the share that was seen on earlier visits, assumed to be the beginning */
  constructor(earlierShare = 0) {
    this.#looks.fill(LOOKS, 0, Math.floor(earlierShare * PARTS))
  }

  /** Count a second during which the window shows the text from one share of its height to another. */
  look(from, to) {
    const [start, end] = [Math.max(0, Math.floor(from * PARTS)), Math.min(PARTS, Math.ceil(to * PARTS))]
    if (!(start < end)) return
    this.#total += 1
    for (let part = start; part < end; part++) this.#looks[part] = Math.min(LOOKS, this.#looks[part] + 1)
  }

  get share() {
    return this.#looks.reduce((sum, looks) => sum + Number(looks === LOOKS), 0) / PARTS
  }

  /** The seconds for which the text was in sight, on this visit. */
  get seconds() {
    return this.#total
  }

  get isRead() {
    return this.#total >= LEAST && this.#looks[PARTS - 1] === LOOKS && this.share >= ENOUGH
  }
}
