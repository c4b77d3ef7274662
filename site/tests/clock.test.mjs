/** Real time is kept by whole timesteps. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Clock } from '../js/lab/core/clock.js'

/** Run a clock for `seconds` in frames, on a machine that makes at most `most` steps in a frame. */
function run(clock, { seconds, frame = 1 / 60, timestep = 0.002, most = Infinity, start = 0 }) {
  let steps = 0
  for (let i = 0; i <= Math.round(seconds / frame); i++) {
    const now = start + i * frame
    const made = Math.min(clock.stepsDue(now, timestep), most)
    clock.countSteps(made, timestep, now)
    steps += made
  }
  return steps
}

test('a second is as many steps as fit into it, whatever the frame rate', () => {
  for (const frame of [1 / 240, 1 / 60, 1 / 59.94, 1 / 24]) {
    for (const timestep of [0.0005, 0.002, 0.005, 0.0166]) {
      const steps = run(new Clock(), { seconds: 1, frame, timestep })
      const passed = Math.round(1 / frame) * frame
      assert.ok(Math.abs(steps * timestep - passed) <= timestep * 1.001, `${steps} steps of ${timestep} at ${frame}`)
    }
  }
})

test('nothing is lost to rounding in an hour', () => {
  assert.equal(run(new Clock(), { seconds: 3600, timestep: 0.001 }), 3_600_000)
})

test('a timestep longer than a frame, and longer than what is made up for, still comes due', () => {
  assert.equal(run(new Clock(), { seconds: 10, timestep: 0.5 }), 20)
  assert.equal(run(new Clock(), { seconds: 9, timestep: 3 }), 3)
})

test('speed multiplies', () => {
  for (const speed of [0.1, 0.5, 4]) {
    const clock = new Clock()
    clock.setSpeed(speed)
    assert.equal(run(clock, { seconds: 10 }), Math.round((10 * speed) / 0.002))
    assert.ok(clock.ratio() > 1 - 1e-9)
  }
  for (const speed of [0, -1, NaN, Infinity]) assert.throws(() => new Clock().setSpeed(speed), RangeError)
})

test('a slow model runs slower and says by how much', () => {
  const clock = new Clock()
  const steps = run(clock, { seconds: 10, most: 2 }) // of the 8.33 that a frame needs
  assert.equal(steps, 2 * 601 - 2, 'the first call owes nothing')
  assert.ok(Math.abs(clock.ratio() - 0.24) < 0.001, String(clock.ratio()))
  // It is on time again as soon as it can be.
  run(clock, { seconds: 2, start: 10 })
  assert.ok(clock.ratio() > 1 - 1e-9)
})

test('a pause of the machine is made up for only in part', () => {
  const clock = new Clock()
  run(clock, { seconds: 1 })
  assert.equal(clock.stepsDue(61, 0.002), 50)
})

test('after a stop nothing is owed', () => {
  const clock = new Clock()
  run(clock, { seconds: 1 })
  clock.stop()
  assert.equal(clock.stepsDue(100, 0.002), 0)
  assert.equal(clock.stepsDue(100.01, 0.002), 5)
})

test('a clock that goes backwards owes nothing for it', () => {
  const clock = new Clock()
  clock.stepsDue(5, 0.002)
  assert.equal(clock.stepsDue(4, 0.002), 0)
  assert.equal(clock.stepsDue(4.01, 0.002), 5)
})

test('the timestep may change on the way', () => {
  const clock = new Clock()
  clock.stepsDue(0, 0.002)
  assert.equal(clock.stepsDue(0.01, 0.002), 5)
  clock.countSteps(5, 0.002, 0.01)
  assert.equal(clock.stepsDue(0.02, 0.001), 10)
})

test('the wait is until the next step is due', () => {
  const clock = new Clock()
  clock.setSpeed(0.5)
  clock.stepsDue(0, 0.01)
  clock.stepsDue(0.004, 0.01)
  assert.ok(Math.abs(clock.wait(0.01) - 0.016) < 1e-12)
})
