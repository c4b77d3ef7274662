/** The page's line to the worker. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Connection } from '../js/lab/page/connection.js'

function setUp(url = 'worker.js') {
  const workers = []
  const start = () => {
    const worker = {
      sent: [],
      ended: false,
      postMessage: (message) => worker.sent.push(message),
      terminate: () => (worker.ended = true),
    }
    workers.push(worker)
    return worker
  }
  return { workers, connection: new Connection(url, start) }
}

test('all labs share one worker, which starts with the first', () => {
  const { workers, connection } = setUp()
  assert.equal(workers.length, 0)
  const got = { a: [], b: [] }
  const a = connection.open('a', (message) => got.a.push(message.type))
  connection.open('b', (message) => got.b.push(message.type))
  assert.equal(workers.length, 1)
  a.send({ type: 'play' })
  assert.deepEqual(workers[0].sent, [{ type: 'play', lab: 'a' }])
  workers[0].onmessage({ data: { type: 'ready', lab: 'b' } })
  assert.deepEqual(got, { a: [], b: ['ready'] })
  assert.throws(() => connection.open('a', () => {}), /twice/)
})

test('a closed lab is disposed of once and hears nothing more', () => {
  const { workers, connection } = setUp()
  const got = []
  const line = connection.open('a', (message) => got.push(message))
  line.close()
  line.close()
  workers[0].onmessage({ data: { type: 'frame', lab: 'a' } })
  assert.deepEqual(workers[0].sent, [{ type: 'dispose', lab: 'a' }])
  assert.equal(got.length, 0)
})

test('when the engine ends every lab is told once, and the next one gets a new worker', () => {
  const { workers, connection } = setUp()
  const got = { a: [], b: [] }
  const a = connection.open('a', (message) => got.a.push(message))
  connection.open('b', (message) => got.b.push(message))
  workers[0].onmessage({ data: { type: 'error', lab: 'a', message: 'out of memory', entry: [], kind: 'engine', fatal: true } })
  assert.deepEqual(
    got.a.map(({ message }) => message),
    ['out of memory'],
  )
  assert.deepEqual(
    got.b.map(({ kind, fatal }) => [kind, fatal]),
    [['worker', true]],
  )
  assert.ok(workers[0].ended)
  a.close()
  connection.open('a', () => {})
  assert.equal(workers.length, 2)
})

test('a worker that does not start is told as an error', () => {
  const { workers, connection } = setUp()
  const got = []
  connection.open('a', (message) => got.push(message))
  workers[0].onerror({ message: undefined })
  assert.deepEqual(
    got.map(({ type, fatal }) => [type, fatal]),
    [['error', true]],
  )
})

test('a worker of one lab ends with it, and when it does not answer', (t) => {
  t.mock.timers.enable({ apis: ['setInterval'] })
  const { workers, connection } = setUp('worker.js#a')
  const got = []
  connection.open('a', ({ kind }) => got.push(kind)).close()
  assert.ok(workers[0].ended)
  const line = connection.open('a', ({ kind }) => got.push(kind))
  for (let i = 0; i < 10; i++) {
    t.mock.timers.tick(5000)
    workers[1].onmessage({ data: { type: 'pong' } })
  }
  assert.ok(!workers[1].ended, 'it answers')
  t.mock.timers.tick(60_000)
  assert.ok(workers[1].ended)
  assert.deepEqual(got, ['silent'], 'told once')
  assert.equal(workers[0].sent.filter(({ type }) => type === 'ping').length, 0)
  line.close()
})
