import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import test from 'node:test'
import { pageFile, readPages, readShard, shardFile } from '../js/search/index.js'
import { distance, lexicon, likelyTerms, tolerance } from '../js/search/spelling.js'
import { hashOf } from '../js/page/hash.js'
import { isFuzzy, placesOf, shelfOf, termsOf, wordsOf } from '../js/search/words.js'
import { encoded } from './search-helpers.mjs'

const agreed = JSON.parse(readFileSync(new URL('search-words.json', import.meta.url)))

test('the terms of a text are those of the build', () => {
  assert.ok(agreed.terms.length > 30)
  for (const [text, terms] of agreed.terms) assert.deepEqual(termsOf(text), terms, text)
})

test('so is the file that has a term', () => {
  for (const [term, shelf, fuzzy, hash] of agreed.shelves) {
    assert.deepEqual([shelfOf(term), isFuzzy(term), hashOf(shelf)], [shelf, fuzzy, hash], term)
  }
})

test('a word is asked for as a whole before its parts', () => {
  assert.deepEqual(wordsOf('mj_step Δt'), [
    ['mj_step', 'mjstep', 'mj', 'step'],
    ['deltat', 'delta'],
  ])
})

test('pairs of a script without spaces are words, its last sign only where it is alone', () => {
  assert.deepEqual(wordsOf('慣性力'), [['慣性'], ['性力']])
  assert.deepEqual(wordsOf('力'), [['力']])
})

test('places are those of the text as it is', () => {
  const text = 'Die Träge Iₓₓ, 慣性力 und 𝛚.'
  const said = placesOf(text).map(({ start, end, terms }) => [text.slice(start, end), terms[0]])
  assert.deepEqual(said, [
    ['Die', 'die'],
    ['Träge', 'trage'],
    ['Iₓₓ', 'ixx'],
    ['慣性', '慣性'],
    ['性力', '性力'],
    ['力', '力'],
    ['und', 'und'],
    ['𝛚', 'omega'],
  ])
})

test('pages are read as they were written, also with large differences', () => {
  const pages = [
    [0, 15],
    [1, 0],
    [2, 4],
    [700, 13],
    [1999, 7],
    [99999, 1],
  ]
  assert.deepEqual(readPages(encoded(pages)), pages)
  assert.deepEqual(readPages(''), [])
})

test('a shard is read by lines, those without pages too', () => {
  assert.deepEqual([...readShard('alone\nbody 3A\n')], [
    ['alone', ''],
    ['body', '3A'],
  ])
  assert.equal(readShard('').size, 0)
})

test('files are named by number and hash', () => {
  const listing = { files: '0123456789abcdef', terms: 1, words: 1 }
  assert.equal(shardFile(listing, 1), 'assets/search/0001.89abcdef.js')
  assert.equal(pageFile(['a.html', 0, 'A', '', 'abc']), 'assets/search/p.abc.js'.replace('p.', ''))
})

test('a distance counts swaps as one mistake', () => {
  const pairs = [
    ['drfit', 'drift', 1],
    ['euler', 'euler', 0],
    ['uler', 'euler', 1],
    ['eluer', 'euler', 1],
    ['inertia', 'inertai', 1],
    ['kitten', 'sitting', 3],
    ['', 'abc', 3],
    ['abc', '', 3],
  ]
  for (const [a, b, far] of pairs) assert.equal(distance(a, b), far, `${a} ${b}`)
})

test('short words have no mistakes, long ones two', () => {
  assert.deepEqual(['abc', 'abcd', 'abcdefg', 'abcdefgh'].map(tolerance), [0, 1, 1, 2])
})

test('the likeliest word comes first', () => {
  const terms = lexicon(['drift', 'draft', 'orbit', 'profit', 'drifts', 'unit'])
  assert.deepEqual(likelyTerms('drfit', [terms]), [['drift', 1]])
  assert.deepEqual(likelyTerms('drift', [terms]), [
    ['draft', 1],
    ['drifts', 1],
  ])
  assert.deepEqual(likelyTerms('rift', [terms]), [['drift', 1]])
  assert.deepEqual(likelyTerms('uni', [terms]), [])
})
