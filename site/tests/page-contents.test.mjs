/** The contents list: which entry is marked, and how far a long list moves to show it. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { currentHeading, listMove } from '../js/page/contents.js'

test('the heading that is read is the last at or above the line', () => {
  const tops = [-900, -20, 100, 100, 640]
  assert.equal(currentHeading(tops, -901), -1)
  assert.equal(currentHeading(tops, -900), 0)
  assert.equal(currentHeading(tops, 99), 1)
  assert.equal(currentHeading(tops, 100), 3)
  assert.equal(currentHeading(tops, 5000), 4)
  assert.equal(currentHeading([], 0), -1)
})

const list = { top: 100, bottom: 500 }

test('a list stays where its entry is in sight', () => {
  for (const top of [120, 200, 460]) assert.equal(listMove(list, { top, bottom: top + 20 }), 0)
})

test('a list moves so that the entry and one beside it are in sight', () => {
  assert.equal(listMove(list, { top: 110, bottom: 130 }), -10)
  assert.equal(listMove(list, { top: -300, bottom: -280 }), -420)
  assert.equal(listMove(list, { top: 470, bottom: 490 }), 10)
  assert.equal(listMove(list, { top: 900, bottom: 920 }), 440)
})

test('having moved, it does not move again', () => {
  for (const top of [-5000, 90, 119, 461, 495, 7777]) {
    const move = listMove(list, { top, bottom: top + 20 })
    assert.equal(listMove(list, { top: top - move, bottom: top + 20 - move }), 0)
  }
})

test('an entry as high as the list comes to lie in its middle', () => {
  const move = listMove(list, { top: 700, bottom: 1090 })
  assert.equal(move, 595)
  assert.equal(listMove(list, { top: 700 - move, bottom: 1090 - move }), 0)
})
