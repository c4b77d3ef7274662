/** What has to be done soon is done soon, in turn, and keeps nothing else waiting for ever. */

import assert from 'node:assert/strict'
import { afterEach, beforeEach, test } from 'node:test'
import { createLater } from '../js/lab/worker/later.js'

let channel, later

beforeEach(() => {
  channel = new MessageChannel()
  later = createLater(channel)
})
afterEach(() => channel.port1.close())

test('actions are done later, each once, in the order in which they were asked for', async () => {
  const done = []
  const all = new Promise((resolve) => {
    for (const i of [1, 2, 3]) later(() => done.push(i), 0)
    later(resolve, 0)
  })
  assert.deepEqual(done, [])
  await all
  assert.deepEqual(done, [1, 2, 3])
})

test('what can wait is given to a timer', async (t) => {
  const timers = t.mock.method(globalThis, 'setTimeout')
  await new Promise((resolve) => later(resolve, 3))
  assert.deepEqual(timers.mock.calls.map((call) => call.arguments[1]), [3])
})

test('no timer is set for what has not to wait', async (t) => {
  const timers = t.mock.method(globalThis, 'setTimeout')
  let left = 50
  await new Promise((resolve) => {
    const again = () => (--left > 0 ? later(again, 0) : resolve())
    later(again, 0)
  })
  assert.equal(timers.mock.callCount(), 0)
})

test('messages and timers come through while something is done over and over', async () => {
  const other = new MessageChannel()
  const heard = []
  let turns = 0
  other.port1.onmessage = ({ data }) => heard.push(data)
  await new Promise((resolve) => {
    const again = () => {
      turns += 1
      if (turns === 5) other.port2.postMessage('message')
      if (heard.length === 2) resolve()
      else later(again, 0)
    }
    setTimeout(() => heard.push('timer'), 1)
    later(again, 0)
  })
  other.port1.close()
  assert.deepEqual(heard.sort(), ['message', 'timer'])
})
