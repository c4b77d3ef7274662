import assert from 'node:assert/strict'
import test from 'node:test'

import { noteTops } from '../js/page/notes.js'

const note = (mark, height = 50) => ({ mark, height })

test('a note stands at its mark, the next below it', () => {
  assert.deepEqual(noteTops([note(100), note(400)], [], 1000), [100, 400])
  assert.deepEqual(noteTops([note(100), note(110), note(110)], [], 1000), [100, 164, 228])
})

test('nothing that takes the margin is under a note', () => {
  const taken = [{ top: 90, bottom: 300 }, { top: 310, bottom: 400 }, { top: 520, bottom: 900 }]
  assert.deepEqual(noteTops([note(100), note(480, 60)], taken, 2000), [414, 914])
  assert.deepEqual(noteTops([note(0, 60)], taken, 2000), [0])
  assert.deepEqual(noteTops([note(0, 80)], taken, 2000), [414])
})

test('one that finds no place near its mark is left at the end, and its followers are not', () => {
  const taken = [{ top: 0, bottom: 2000 }]
  assert.deepEqual(noteTops([note(100), note(1900), note(null), note(2100)], taken, 3000), [null, 2014, null, 2100])
})

test('the last notes may begin above their marks but never over another', () => {
  assert.deepEqual(noteTops([note(950, 100)], [], 1000), [900])
  assert.deepEqual(noteTops([note(800, 100), note(950, 100)], [], 1000), [800, null])
  assert.deepEqual(noteTops([note(950, 100)], [{ top: 850, bottom: 920 }], 1000), [null])
  assert.deepEqual(noteTops([note(10, 300)], [], 200), [null])
})
