/**
 * The format of the index: which file has a term, and how to read it.
 *
 * A shard is a text of lines: a term, and after a blank the pages that have it, rising, as differences times 16 plus a
 * weight, in digits of five bits with the lowest first. The weight is the field (3 title, 2 heading, 1 text, 0 code)
 * times 4 plus how often the term occurs (0 once, 1 up to three times, 2 up to nine, 3 more).
 */

import { hashOf } from '../page/hash.js'
import { shelfOf } from './words.js'

const DIGITS = '0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_'
const VALUE = Object.fromEntries([...DIGITS].map((digit, value) => [digit, value]))

/** The number of the shard with the pages of a term, and of all terms that begin with its first letters. */
export const shardOf = (listing, term) => hashOf(shelfOf(term)) & (listing.terms - 1)

/** The number of the shard with the terms that begin with a letter. */
export const spellingOf = (listing, letter) => listing.terms + (hashOf(letter) & (listing.words - 1))

/** The path of a shard's file from the site's root. */
export function shardFile(listing, number) {
  const name = listing.files.slice(8 * number, 8 * number + 8)
  return `assets/search/${number.toString(16).padStart(4, '0')}.${name}.js`
}

/** The path of the file with the text of a page, perhaps of several; its place there is `page[5]`. */
export const pageFile = (page) => `assets/search/${page[4]}.js`

/** The lines of a shard by their term. */
export function readShard(text) {
  const lines = new Map()
  for (const line of text.split('\n')) {
    const end = line.indexOf(' ')
    if (end >= 0) lines.set(line.slice(0, end), line.slice(end + 1))
    else if (line) lines.set(line, '')
  }
  return lines
}

/**
 * The pages of a line, each with its weight.
 * @returns {Array<[page: number, weight: number]>}
 */
export function readPages(line) {
  const pages = []
  let page = 0
  let value = 0
  let shift = 0
  for (const digit of line) {
    const bits = VALUE[digit]
    value += (bits & 31) * 2 ** shift
    shift += 5
    if (bits & 32) continue
    page += Math.floor(value / 16)
    pages.push([page, value % 16])
    value = shift = 0
  }
  return pages
}
