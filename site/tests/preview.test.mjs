/** The preview's pure parts: what of a page stayed, what differs in a text, what the button says. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { align, inOrder } from '../js/preview/align.js'
import { editorLink, summary } from '../js/preview/panel.js'
import { difference } from '../js/preview/twin.js'
import { setClock, timesOf } from '../js/preview/times.js'

const same = (a, b) => a === b
const alike = (a, b) => a[0] === b[0]
const aligned = (before, after) => align(before.split(' '), after.split(' '), same, alike)

test('what is the same is paired, what is alike between it too', () => {
  assert.deepEqual(aligned('a1 b1 c1', 'a1 b1 c1'), [[0, 0], [1, 1], [2, 2]]) // prettier-ignore
  assert.deepEqual(aligned('a1 b1 c1', 'a1 b2 c1'), [[0, 0], [1, 1], [2, 2]]) // prettier-ignore
  assert.deepEqual(aligned('a1 c1', 'a1 b1 c1'), [[0, 0], [null, 1], [1, 2]]) // prettier-ignore
  assert.deepEqual(aligned('a1 b1 c1', 'a1 c1'), [[0, 0], [1, null], [2, 1]]) // prettier-ignore
  assert.deepEqual(aligned('a1 b1 c1', 'a1 d1 c1'), [[0, 0], [1, null], [null, 1], [2, 2]]) // prettier-ignore
})

test('the same counts more than the alike', () => {
  assert.deepEqual(aligned('a1', 'a2 a1'), [[null, 0], [0, 1]]) // prettier-ignore
  assert.deepEqual(aligned('a1 a2 a3', 'a3'), [[0, null], [1, null], [2, 0]]) // prettier-ignore
})

test('nothing, and lists that share nothing', () => {
  assert.deepEqual(align([], [], same, alike), [])
  assert.deepEqual(align([], ['a'], same, alike), [[null, 0]])
  assert.deepEqual(align(['a'], [], same, alike), [[0, null]])
  assert.deepEqual(align(['a'], ['b'], same, alike), [[0, null], [null, 0]]) // prettier-ignore
})

/** Numbers that look random and are the same each time. */
function* numbers(seed) {
  for (let state = seed; ; ) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0
    yield state >>> 8
  }
}

test('each item is told once, in order, and nothing is paired that is neither the same nor alike', () => {
  const random = numbers(42)
  const next = (limit) => random.next().value % limit
  const list = () => Array.from({ length: next(9) }, () => 'abc'[next(3)] + next(3))
  for (let round = 0; round < 2000; round++) {
    const [before, after] = [list(), list()]
    const pairs = align(before, after, same, alike)
    assert.deepEqual(pairs.filter(([i]) => i !== null).map(([i]) => i), [...before.keys()]) // prettier-ignore
    assert.deepEqual(pairs.filter(([, j]) => j !== null).map(([, j]) => j), [...after.keys()]) // prettier-ignore
    for (const [i, j] of pairs) if (i !== null && j !== null) assert.ok(alike(before[i], after[j]))
    const kept = pairs.filter(([i, j]) => i !== null && j !== null && before[i] === after[j]).length
    assert.ok(kept >= longest(before, after), `${before} → ${after}`)
  }
})

function longest(before, after) {
  if (before.length === 0 || after.length === 0) return 0
  const [[a, ...one], [b, ...two]] = [before, after]
  return a === b ? 1 + longest(one, two) : Math.max(longest(before, two), longest(one, after))
}

test('long lists that have nothing in common cost no memory', () => {
  const before = Array.from({ length: 3000 }, (_, i) => `a${i}`)
  const after = Array.from({ length: 3000 }, (_, i) => `b${i}`)
  assert.deepEqual(inOrder(['x', ...before, 'y'], ['x', ...after, 'y'], same), [[0, 0], [3001, 3001]]) // prettier-ignore
})

test('one stretch of a text is replaced', () => {
  const apply = (before, { start, count, text }) => before.slice(0, start) + text + before.slice(start + count)
  for (const [before, after] of [
    ['', ''],
    ['', 'abc'],
    ['abc', ''],
    ['abc', 'abc'],
    ['abc', 'axc'],
    ['aaa', 'aa'],
    ['aa', 'aaa'],
    ['one two three', 'one three'],
  ]) {
    assert.equal(apply(before, difference(before, after)), after, `${before} → ${after}`)
  }
  assert.deepEqual(difference('one two', 'one 2 two'), { start: 4, count: 0, text: '2 ' })
})

test('no half of a character is left', () => {
  assert.deepEqual(difference('a\u{1f600}b', 'a\u{1f601}b'), { start: 1, count: 2, text: '\u{1f601}' })
  assert.deepEqual(difference('\u{1f600}', '\u{1fa00}'), { start: 0, count: 2, text: '\u{1fa00}' })
})

test('the button says how things stand', () => {
  const say = (key, { n } = {}) => (n === undefined ? key : `${n} ${key}`)
  const text = (...state) => summary(say, ...state)
  const news = (severities, more = {}) => ({ problems: severities.map((severity) => ({ severity })), busy: '', trouble: '', running: [], ...more })
  assert.equal(text(news([])), '')
  assert.equal(text(news(['error'])), '1 errors')
  assert.equal(text(news(['error', 'warning', 'error'])), '2 errors, 1 warnings')
  assert.equal(text(news([], { busy: 'running scripts' })), 'running scripts …')
  assert.equal(text(news(['warning'], { busy: 'trying labs' }), true), 'lost, 1 warnings')
  assert.equal(text(news([], { trouble: 'x' }), false, true), 'gone, trouble')
})

test('what is left of a script is told by its last time and the clock of the server', () => {
  const now = Date.now() / 1000 + 500
  setClock(now)
  assert.deepEqual(timesOf({ began: now - 4, last: 17.2 }), { last: 17, left: 13 })
  assert.deepEqual(timesOf({ began: now - 40, last: 17.2 }), { last: 17, left: 0 })
  assert.equal(timesOf({ began: now, last: 0.4 }), null)
  assert.equal(timesOf({ began: now, last: null }), null)
  const say = (key, values = {}) => `${key} ${values.path} ${values.left}`
  const running = [4, 17.2, null].map((last, index) => ({ path: `${index}.py`, began: now - 4, last }))
  assert.equal(summary(say, { problems: [], busy: 'running scripts', trouble: '', running }), 'left 1.py 13')
})

test('a link to an editor names any file', () => {
  assert.equal(editorLink('/home/a b', 'content/x#1%.md:3:5'), 'vscode://file/home/a%20b/content/x%231%25.md:3:5')
})
