/** How far the axes of plots reach. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { spanOf } from '../js/lab/page/span.js'

const near = (found, wanted) => found.forEach((y, i) => assert.ok(Math.abs(y - wanted[i]) < 1e-12, `${found} is not ${wanted}`))

test('open bounds follow the data and the reference lines, with room', () => {
  near(spanOf({}, 1, 2), [0.94, 2.06])
  near(spanOf({ refLines: [{ y: 3 }] }, 1, 2), [0.88, 3.12])
  near(spanOf({ ymin: 0 }, 1, 2), [0, 2.12])
  near(spanOf({ ymin: 0, ymax: 5 }, 1, 2), [0, 5])
})

test('a flat line has a scale', () => {
  near(spanOf({}, 2, 2), [1.9, 2.1])
  near(spanOf({}, -2, -2), [-2.1, -1.9])
  near(spanOf({}, 0, 0), [-1, 1])
  near(spanOf({}, 2, 2 + 1e-13), [1.9, 2.1])
  near(spanOf({ ymin: 2, ymax: 2 + 1e-11 }, 0, 0), [2, 2 + 1e-11])
})

test('so has a plot that waits for its first sample', () => {
  near(spanOf({}, null, null), [-1, 1])
  near(spanOf({ ymin: 0 }, null, null), [0, 1])
  near(spanOf({ ymax: 5 }, null, null), [-0.3, 5])
  near(spanOf({ ymin: 5 }, null, null), [5, 5.25])
  near(spanOf({ ymax: 0 }, null, null), [-1, 0])
  near(spanOf({ ymax: 0 }, 0, 0), [-1, 0])
  near(spanOf({ ymax: 0, refLines: [{ y: 0 }] }, undefined, undefined), [-1, 0])
})

test('data beyond the one bound that is given leave the axis upright', () => {
  near(spanOf({ ymax: 0 }, 5, 6), [-1, 0])
  near(spanOf({ ymin: 10 }, 5, 6), [10, 10.5])
})
