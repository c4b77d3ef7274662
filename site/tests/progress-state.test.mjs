/** Merging states of a reader's progress, whatever has happened to them, and reading them back. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { decode, emptyState, encode, LAST_TICK, latestRecalls, merge, NOTHING, StateError, RECALLS } from '../js/progress/state.js'
import { answer, random } from './progress-helpers.mjs'

const text = (state) => encode(state, 'c')
const pick = (draw, list) => list[Math.floor(draw() * list.length)]

/** A state of random entries with few names and few ticks, so that equal ones, removals and resets often meet. */
function anyState(draw) {
  const tick = () => Math.floor(draw() * 12)
  const entry = (names) => {
    const values = new Map(names.filter(() => draw() < 0.7).map((name) => [name, { tick: tick(), ...value(name) }]))
    const recalls = Array.from({ length: Math.floor(draw() * 4) }, () => ({ tick: tick(), right: draw() < 0.5, at: tick() }))
    return { gone: draw() < 0.2 ? tick() : 0, values, recalls: latestRecalls(recalls) }
  }
  const value = (name) => {
    const at = `2026-01-0${1 + Math.floor(draw() * 3)}T00:00:00.000Z`
    if (name === 'read') return { value: draw() < 0.5, at }
    if (name === 'place') return { section: pick(draw, ['', 'a']), title: '', share: draw(), at }
    return answer({ given: pick(draw, ['x', ['b', 'a'], null, { v: 1, u: 'm' }]), right: pick(draw, [true, false, null]), at })
  }
  const map = (keys, make) => new Map(keys.filter(() => draw() < 0.6).map((key) => [key, make()]))
  const state = {
    reset: draw() < 0.3 ? tick() : 0,
    answers: map(['q', '__proto__', 'ü"<'], () => map(['1', '2'], () => entry(['answer']))),
    lessons: map(['4.2', 'constructor'], () => entry(['read', 'place'])),
  }
  return merge(state, emptyState())
}

test('merging is commutative, associative and idempotent', () => {
  const draw = random(6)
  for (let i = 0; i < 1000; i++) {
    const [a, b, c] = [anyState(draw), anyState(draw), anyState(draw)]
    assert.equal(text(merge(a, b)), text(merge(b, a)))
    assert.equal(text(merge(merge(a, b), c)), text(merge(a, merge(b, c))))
    assert.equal(text(merge(a, a)), text(a))
    assert.equal(text(merge(merge(a, b), b)), text(merge(a, b)), 'what is known changes nothing')
    assert.equal(text(merge(a, emptyState())), text(a))
  }
})

test('text is read back as it was, and equal states have equal texts', () => {
  const draw = random(7)
  for (let i = 0; i < 1000; i++) {
    const state = anyState(draw)
    const kept = text(state)
    const again = decode(JSON.parse(kept), assert.fail)
    assert.equal(text(again), kept)
  }
})

test('no more recalls are kept than count, and which they are does not depend on the order of merging', () => {
  const many = Array.from({ length: 40 }, (_, n) => ({ tick: n + 1, right: n % 2 === 0, at: n }))
  const state = (recalls) => ({ ...emptyState(), answers: new Map([['q', new Map([['1', { ...NOTHING, recalls }]])]]) })
  const parts = [many.slice(0, 15), many.slice(10, 30), many.slice(25)].map(state)
  const all = [
    [0, 1, 2],
    [2, 1, 0],
    [1, 0, 2],
  ].map((order) => text(order.map((n) => parts[n]).reduce(merge)))
  assert.equal(new Set(all).size, 1)
  const [kept] = decode(JSON.parse(all[0]), assert.fail).answers.get('q').values()
  assert.deepEqual(kept.recalls.map(({ tick }) => tick), Array.from({ length: RECALLS }, (_, n) => 41 - RECALLS + n))
})

test('an entry that is not as it should be is told by its place, and the others are read', () => {
  const good = { answer: { tick: 3, ...answer() } }
  const bad = [
    null,
    7,
    [],
    { answer: null },
    { answer: { ...good.answer, tick: -1 } },
    { answer: { ...good.answer, tick: LAST_TICK + 1 } },
    { answer: { ...good.answer, tick: 1.5 } },
    { answer: { ...good.answer, kind: 3 } },
    { answer: { ...good.answer, right: 'yes' } },
    { answer: { ...good.answer, tries: -2 } },
    { answer: { ...good.answer, at: 'yesterday' } },
    { answer: { ...good.answer, at: '2026-99-99T00:00:00Z' } },
    { answer: { ...good.answer, given: [[[[['deep']]]]] } },
    { other: { tick: 1 } },
    { constructor: { tick: 1 } },
    { ...good, recalls: [[1, true, 1]] },
    { ...good, recalls: 'many' },
    { ...good, gone: '3' },
  ]
  for (const entry of bad) {
    const told = []
    const state = decode({ reset: 0, answers: { q: { bad: entry, good } }, lessons: {} }, (error) => told.push(error))
    assert.deepEqual([...state.answers.get('q').keys()], ['good'], JSON.stringify(entry))
    assert.equal(told.length, 1)
    assert.ok(told[0] instanceof StateError)
    assert.match(told[0].path, /^answers, q, bad/)
  }
  const lessons = { a: { place: { tick: 1, section: '', title: '', share: 2, at: '2026-01-01T00:00:00Z' } }, b: { read: { tick: 1, value: 1 } } }
  const told = []
  assert.equal(decode({ reset: 0, answers: {}, lessons }, (error) => told.push(error.path)).lessons.size, 0)
  assert.deepEqual(told, ['lessons, a, place', 'lessons, b, read'])
  for (const whole of [null, [], 'x', {}, { answers: {}, lessons: [] }, { answers: {}, lessons: {}, reset: null }]) {
    assert.throws(() => decode(whole, assert.fail), StateError)
  }
})
