import assert from 'node:assert/strict'
import { test } from 'node:test'

import { MODEST, addressOf, digitsOf, groupsFor, isSparing, pagesFor, parseList, pathOf, rangeOf } from '../js/offline/list.js'
import { SCOPE, built } from './offline-kit.mjs'

test('a list says which files there are', () => {
  const list = parseList(built({ 'index.html': 'home', 'a.html': 'a', 'assets/x.HASH.js': 'x' }).get('files.json'))
  assert.deepEqual(list.groups, { shell: ['index.html'], text: ['a.html', 'assets/x.2d711642.js'], rest: [] })
  assert.equal(list.files.get('assets/x.2d711642.js'), '')
  assert.match(list.files.get('a.html'), /^[0-9a-f]{12}$/)
  assert.deepEqual(list.bytes, { shell: 4, text: 2, rest: 0 })
})

test('what is no list is not taken for one', () => {
  const wrong = ['', 'null', '[]', '{"format":2}', '{"format":1}', '<!DOCTYPE html>', '{"format":1,"shell":{"bytes":1,"files":{"a":3}}}']
  for (const text of wrong) assert.throws(() => parseList(text), undefined, text)
})

test('addresses and paths', () => {
  for (const path of ['index.html', 'über uns.html', 'a%b?#.html', 'models/детали/куб.html', '图.svg', 'a+b@c.html']) {
    assert.equal(pathOf(addressOf(path, SCOPE), SCOPE), path)
  }
  assert.equal(pathOf('https://example.org/course/', SCOPE), '')
  assert.equal(pathOf('https://example.org/course/a.html?q=1#x', SCOPE), 'a.html')
  for (const elsewhere of ['https://example.org/other/a.html', 'https://example.com/course/a.html', 'http://example.org/course/a.html']) {
    assert.equal(pathOf(elsewhere, SCOPE), null)
  }
  assert.equal(pathOf('https://example.org/course/%E0%A4%A', SCOPE), null)
})

test('only names with a hash in the folder of assets last', () => {
  assert.equal(digitsOf('assets/fonts/f.latin.0123abcd.woff2'), '0123abcd')
  for (const path of ['a.0123abcd.js', 'assets/a.js', 'assets/a.0123abcd', 'assets/a.0123ABCD.js', 'files/assets/a.0123abcd.js']) {
    assert.equal(digitsOf(path), null, path)
  }
})

test('hosts leave out parts of names', () => {
  assert.deepEqual(pagesFor(''), ['index.html'])
  assert.deepEqual(pagesFor('glossary/'), ['glossary/index.html'])
  assert.deepEqual(pagesFor('about'), ['about', 'about.html', 'about/index.html'])
  assert.deepEqual(pagesFor('lessons/4.2-mass'), ['lessons/4.2-mass', 'lessons/4.2-mass.html', 'lessons/4.2-mass/index.html'])
  assert.deepEqual(pagesFor('a.html'), ['a.html', 'a.html.html'])
})

test('what is fetched', () => {
  const list = { bytes: { shell: 1, text: 5, rest: 1e9 } }
  const large = { bytes: { shell: 1, text: MODEST, rest: 0 } }
  assert.deepEqual(groupsFor('auto', list, false), ['shell', 'text'])
  assert.deepEqual(groupsFor('auto', list, true), ['shell'])
  assert.deepEqual(groupsFor('auto', large, false), ['shell'])
  assert.deepEqual(groupsFor('read', list, false), ['shell'])
  assert.deepEqual(groupsFor('text', large, true), ['shell', 'text'])
  assert.deepEqual(groupsFor('all', large, true), ['shell', 'text', 'rest'])
})

test('a network that is to be spared', () => {
  assert.equal(isSparing(undefined), false)
  assert.equal(isSparing({ saveData: false, type: 'wifi', effectiveType: '4g' }), false)
  for (const one of [{ saveData: true }, { type: 'cellular', effectiveType: '4g' }, { effectiveType: '3g' }, { effectiveType: 'slow-2g' }]) {
    assert.equal(isSparing(one), true)
  }
})

test('parts of files', () => {
  assert.deepEqual(rangeOf('bytes=0-', 10), [0, 10])
  assert.deepEqual(rangeOf('bytes=2-5', 10), [2, 6])
  assert.deepEqual(rangeOf(' bytes=7-99', 10), [7, 10])
  assert.deepEqual(rangeOf('bytes=-3', 10), [7, 10])
  assert.deepEqual(rangeOf('bytes=-30', 10), [0, 10])
  for (const none of ['bytes=10-', 'bytes=5-2', 'bytes=-', 'bytes=-0', 'bytes=0-1,3-4', 'lines=1-2', '']) {
    assert.equal(rangeOf(none, 10), null, none)
  }
})
