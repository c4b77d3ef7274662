/** The samples behind a plot. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { curvesText } from '../js/lab/page/export.js'
import { History } from '../js/lab/page/history.js'

const filled = (history, count, dt = 0.01) => {
  for (let i = 0; i < count; i++) history.push(i * dt, [9, i, -i], 1)
  return history
}

test('samples come out in order, each trace from its place', () => {
  const [times, a, b] = filled(new History(2, null), 3, 1).columns
  assert.deepEqual(
    [[...times], [...a], [...b]],
    [
      [0, 1, 2],
      [0, 1, 2],
      [-0, -1, -2],
    ],
  )
})

test('a window keeps one sample before it, however long the run', () => {
  const history = filled(new History(2, 5), 100_000)
  const [times, a] = history.columns
  assert.ok(times[0] < history.last - 5 && times[1] >= history.last - 5 - 1e-9)
  assert.equal(a[a.length - 1], 99_999)
  assert.ok(times.every((time, i) => i === 0 || time > times[i - 1]))
  assert.ok(history.columns[0].length <= 4096, `${history.columns[0].length} places`)
})

test('a plot of everything thins out and still spans the whole run', () => {
  const history = filled(new History(2, null), 50_000)
  const [times, a, b] = history.columns
  assert.ok(history.length > 1500 && history.length <= 4000, String(history.length))
  assert.equal(times[0], 0)
  assert.ok(history.last > 499)
  times.forEach((time, i) => {
    assert.equal(a[i], Math.round(time * 100))
    assert.equal(b[i], -a[i])
  })
  const gaps = times.slice(1).map((time, i) => Math.round((time - times[i]) * 100))
  assert.ok(
    gaps.every((gap) => gap === gaps[0]),
    'evenly',
  )
})

test('cleared, it begins anew', () => {
  const history = filled(new History(2, null), 50_000)
  history.clear()
  assert.equal(history.length, 0)
  assert.equal(history.last, 0)
  assert.equal(filled(history, 10).length, 10)
})

test('what comes after a time is dropped, and a window is filled again from the whole run', () => {
  const whole = filled(new History(2, null), 1000)
  const recent = filled(new History(2, 2), 1000)
  whole.cut(4.005)
  recent.refill(whole, 4.005 - 2)
  for (const history of [whole, recent]) assert.ok(Math.abs(history.last - 4) < 1e-9)
  assert.ok(Math.abs(recent.columns[0][0] - 2.01) < 1e-9)
  recent.push(4.01, [9, 7, 8], 1)
  assert.deepEqual(recent.at(4.01), [7, 8])
  whole.cut(-1)
  assert.equal(whole.length, 0)
})

test('between two samples a value lies on a straight line, and a gap stays a gap', () => {
  const history = new History(1, null)
  for (const [time, value] of [[0, 1], [1, 3], [2, NaN]]) history.push(time, [value], 0)
  assert.deepEqual([history.at(0), history.at(0.25), history.at(1)], [[1], [1.5], [3]])
  assert.ok(Number.isNaN(history.at(1.5)[0]))
  assert.ok(Number.isNaN(history.at(9)[0]))
})

test('curves are written as a table that programs read', () => {
  const columns = [[0, 0.5], [1, NaN], [-2e-20, 3]].map((column) => Float64Array.from(column))
  const curves = [
    { ylabel: 'angle (rad)', labels: ['left', 'a "b", c'], columns },
    { ylabel: 'energy', labels: ['energy'], columns: [columns[0], columns[2]] },
  ]
  assert.equal(curvesText(curves), 'time (s),left: angle (rad),"a ""b"", c: angle (rad)",energy\r\n0,1,-2e-20,-2e-20\r\n0.5,,3,3\r\n')
})
