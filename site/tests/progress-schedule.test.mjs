/** When missed questions come back: Leitner's boxes. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { agenda, changesSchedule, reviewState, WAITS } from '../js/progress/schedule.js'
import { random } from './progress-helpers.mjs'

const DAY = 86_400_000
const START = Date.UTC(2026, 0, 1, 20)
const wrong = (at) => ({ right: false, at })
const right = (at) => ({ right: true, at })

test('what was right at the first go does not come back', () => {
  assert.equal(reviewState([], START), null)
  assert.equal(reviewState([right(START)], START), null)
  assert.equal(changesSchedule([], right(START)), false)
})

test('a missed question comes back the next evening, then later and later, and leaves', () => {
  let recalls = [wrong(START)]
  let day = START
  const gaps = []
  for (let round = 0; round < 5; round++) {
    const { box, due } = reviewState(recalls, day)
    assert.equal(box, round)
    assert.ok(due > day && due < day + WAITS[round] + DAY)
    const next = day + Math.ceil((due - day) / DAY) * DAY
    gaps.push((next - day) / DAY)
    day = next
    assert.ok(changesSchedule(recalls, right(day)))
    recalls = [...recalls, right(day)]
  }
  assert.deepEqual(gaps, [1, 3, 7, 16, 35])
  assert.equal(reviewState(recalls, day), null)
})

test('missed again, it starts from the first box', () => {
  const recalls = [wrong(START), right(START + DAY), right(START + 4 * DAY), wrong(START + 11 * DAY)]
  assert.deepEqual(reviewState(recalls.slice(0, 3), START + 5 * DAY), { box: 2, due: START + 4 * DAY + WAITS[2] })
  assert.deepEqual(reviewState(recalls, START + 11 * DAY), { box: 0, due: START + 11 * DAY + WAITS[0] })
})

test('an answer before its day moves nothing and is not kept', () => {
  const recalls = [wrong(START)]
  const early = right(START + 60_000)
  assert.deepEqual(reviewState([...recalls, early], START), reviewState(recalls, START))
  assert.equal(changesSchedule(recalls, early), false)
})

test('tries that follow each other are one miss; a miss on another day counts', () => {
  assert.equal(changesSchedule([wrong(START)], wrong(START + 60_000)), false)
  assert.equal(changesSchedule([wrong(START)], wrong(START + DAY / 2)), true)
})

test('a clock that was ahead makes a question due at once, not in years', () => {
  const now = START
  const ahead = START + 3650 * DAY
  assert.deepEqual(reviewState([wrong(ahead)], now), { box: 0, due: now })
  assert.equal(reviewState([wrong(ahead), right(now)], now).box, 1)
  assert.deepEqual(reviewState([wrong(now), right(ahead)], now), { box: 1, due: now })
})

test('a clock that was behind makes a question due at once', () => {
  const { box, due } = reviewState([wrong(0)], START)
  assert.equal(box, 0)
  assert.ok(due < START)
})

test('leaving out what does not count gives the same standing, in random histories', () => {
  const draw = random(3)
  for (let i = 0; i < 2000; i++) {
    let at = START
    let [all, kept] = [[], []]
    for (let n = 0; n < 25; n++) {
      at += Math.floor(draw() ** 8 * 30 * DAY)
      const recall = draw() < 0.6 ? right(at) : wrong(at)
      all = [...all, recall]
      if (changesSchedule(kept, recall)) kept = [...kept, recall]
      assert.deepEqual(reviewState(all, at), reviewState(kept, at))
    }
  }
})

test('the agenda has what is due, first boxes first, and counts the rest by day', () => {
  const now = START + 4 * DAY
  const answers = [
    { key: 'second box', recalls: [wrong(START - 9 * DAY), right(START - 3 * DAY)] },
    { key: 'old', recalls: [wrong(START)] },
    { key: 'older', recalls: [wrong(START - DAY)] },
    { key: 'fresh', recalls: [wrong(now)] },
    { key: 'fresh too', recalls: [wrong(now - 1000)] },
    { key: 'third box', recalls: [wrong(START - 9 * DAY), right(START - 3 * DAY), right(now)] },
    { key: 'never missed', recalls: [right(START)] },
  ]
  const { due, later } = agenda(answers, now)
  assert.deepEqual(due.map(({ key }) => key), ['older', 'old', 'second box'])
  assert.deepEqual(later, [
    { days: 1, count: 2 },
    { days: 7, count: 1 },
  ])
})
