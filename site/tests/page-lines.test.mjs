import assert from 'node:assert/strict'
import test from 'node:test'

import { lineAt, readLines, writeLines } from '../js/page/lines.js'

test('an address names lines of a listing', () => {
  assert.deepEqual(readLines('#l4_2_inertia.L12'), { stem: 'l4_2_inertia', first: 12, last: 12 })
  assert.deepEqual(readLines('#sub/a.b.L3-L20'), { stem: 'sub/a.b', first: 3, last: 20 })
  assert.deepEqual(readLines('#%C3%A9.L1'), { stem: 'é', first: 1, last: 1 })
})

test('what names no lines is no such address', () => {
  for (const hash of ['', '#', '#a', '#a.L0', '#a.L-1', '#a.L5-L4', '#.L', '#a.L1-L', '#a.L1-2', '#a.L9999999999', '#%', '#lab=4.2&z=L1']) {
    assert.equal(readLines(hash), null, hash)
  }
})

test('what is written is read again, whichever way a range was marked', () => {
  assert.equal(writeLines('a', 4, 4), '#a.L4')
  assert.equal(writeLines('a', 9, 4), '#a.L4-L9')
  for (const stem of ['a', 'sub/ü␣x', '50%', 'a#b?c']) {
    assert.deepEqual(readLines(writeLines(stem, 2, 7)), { stem, first: 2, last: 7 })
  }
})

test('a height of the column is a line, and none beyond its ends', () => {
  assert.equal(lineAt(0, 100, 11, 10), 11)
  assert.equal(lineAt(95, 100, 11, 10), 20)
  assert.equal(lineAt(100, 100, 11, 10), 20)
  assert.equal(lineAt(-3, 100, 11, 10), 11)
})
