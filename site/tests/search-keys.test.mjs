import assert from 'node:assert/strict'
import test from 'node:test'
import { meaning } from '../js/page/search.js'

const key = (name, more = {}) => ({ key: name, ctrlKey: false, metaKey: false, altKey: false, isComposing: false, ...more })
const place = (more = {}) => ({ taken: false, single: true, mac: false, ...more })

test('a stroke opens the search, unless it belongs to something else or is switched off', () => {
  assert.equal(meaning(key('/'), place()), 'open')
  assert.equal(meaning(key('/', { shiftKey: true }), place()), 'open', 'where it is typed with Shift')
  assert.equal(meaning(key('/'), place({ taken: true })), null)
  assert.equal(meaning(key('/'), place({ single: false })), null)
  assert.equal(meaning(key('/', { ctrlKey: true }), place()), null)
  assert.equal(meaning(key('/', { isComposing: true }), place()), null)
})

test('Ctrl+K or Cmd+K does so everywhere', () => {
  for (const more of [{ ctrlKey: true }, { metaKey: true }]) {
    assert.equal(meaning(key('k', more), place({ taken: true, single: false })), 'open')
    assert.equal(meaning(key('K', more), place()), 'open')
  }
  assert.equal(meaning(key('k'), place()), null)
  assert.equal(meaning(key('k', { ctrlKey: true, metaKey: true }), place()), null)
  assert.equal(meaning(key('k', { ctrlKey: true, altKey: true }), place()), null)
})

test('on a Mac, Ctrl+K stays with a field that is written in', () => {
  assert.equal(meaning(key('k', { ctrlKey: true }), place({ mac: true, taken: true })), null)
  assert.equal(meaning(key('k', { metaKey: true }), place({ mac: true, taken: true })), 'open')
  assert.equal(meaning(key('k', { ctrlKey: true }), place({ mac: true })), 'open')
})
