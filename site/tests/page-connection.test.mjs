/** The page's line to the worker. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Connection } from '../js/lab/page/connection.js'

function setUp() {
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
  return { workers, connection: new Connection('worker.js', start) }
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
