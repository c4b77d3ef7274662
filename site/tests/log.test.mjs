/** What is done in a run is logged, replayed bit for bit, carried by a link, and held against a goal. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { deflateRawSync } from 'node:zlib'
import { readLink, writeLink, writeLog } from '../js/lab/page/share.js'
import { PENDULUM, control, labOf, newEngine, plot } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

const CONTROLS = [
  control({ label: 'torque', min: -1, max: 1, value: 0 }),
  control({ label: 'from', type: 'select', options: [['low', 1], ['high', 3]], value: 1, param: 'from', reset: true }),
  control({ label: 'kick', type: 'button' }),
  control({ label: 'again', type: 'button' }),
]
const CODE = {
  setup: ({ data, ctx }) => void (data.qpos[0] = ctx.from),
  controller: ({ data, lib }) => void (data.qfrc_applied[0] = lib.random()),
  controls: [
    { set: ({ data }, value) => (data.ctrl[0] = value) },
    { set: ({ ctx }, value) => (ctx.from = value) },
    { run: ({ data, sim }) => ((data.qvel[0] += 2), sim.step(3)) },
    { run: ({ sim }) => sim.reset() },
  ],
  plots: [[]],
  goal: ({ data }) => Math.abs(data.qvel[0]) > 5,
}
const made = (t, goal = { hold: 0.05, log: [] }) => {
  const lab = labOf(t, engine, PENDULUM, { controls: CONTROLS, plots: [plot(0)], goal }, CODE)
  lab.start()
  return lab
}
const bits = (lab) => [lab.steps, lab.values, Buffer.from(lab.state().physics.buffer).toString('hex')]

/** A run with moves and presses in it, begun anew three times. */
function play(lab) {
  lab.step(20)
  lab.press(3) // a reset of lab code
  lab.step(5)
  lab.setControl(0, 0.5)
  lab.reset() // a reader's
  lab.setControl(1, 3) // a control's
  lab.step(10)
  lab.press(2)
  lab.setControl(0, -1)
  lab.setControl(0, 0.25)
  lab.step(33)
  lab.press(2)
  lab.step(100)
}

test('a log holds the run since its reset, and gives it again bit for bit', (t) => {
  const [one, other] = [made(t), made(t)]
  play(one)
  assert.deepEqual(one.log, { values: [0.5, 1, null, null], events: [[0, 1, 3], [0.02, 2], [0.026, 0, -1], [0.026, 0, 0.25], [0.092, 2]] })
  other.step(7)
  other.replay(structuredClone({ ...one.log, end: one.time }))
  const { stopped } = other.step(10_000)
  assert.equal(stopped, 'stopAt')
  assert.deepEqual(bits(other), bits(one))
  assert.deepEqual(other.log, { ...one.log, replayed: true })
  other.press(2)
  one.press(2)
  one.step(50)
  other.step(50)
  assert.deepEqual(bits(other), bits(one), 'it goes on as the other does')
})

test('a motion that the controls alone do not tell has no log until a reset', (t) => {
  const lab = made(t)
  lab.step(5)
  lab.perturb({ body: 1, point: [0, 0, -0.2], target: [1, 0, 0] })
  lab.press(2)
  assert.equal(lab.log, null)
  lab.reset()
  assert.deepEqual(lab.log.events, [])
  lab.restore({ ...lab.state(), steps: 9 })
  assert.equal(lab.log, null)
  lab.reset()
  for (let i = 0; i <= 10_000; i++) lab.act([0, 0], () => {})
  assert.equal(lab.log, null, 'too long')
})

test('what a reader does ends a replay', (t) => {
  const acts = [(lab) => lab.press(2), (lab) => lab.setControl(0, 1), (lab) => lab.reset(), (lab) => lab.perturb({ body: 1, point: [0, 0, 0], target: [0, 0, 0] }), (lab) => lab.restore(lab.state())]
  for (const act of acts) {
    const lab = made(t)
    lab.replay({ values: [...lab.values], events: [[0.01, 1, 3]] })
    lab.step(1)
    act(lab)
    lab.step(50)
    assert.equal(lab.values[1], 1, String(act))
  }
})

test('a log that the page could not have made is refused, and changes nothing', (t) => {
  const lab = made(t)
  lab.step(3)
  const there = bits(lab)
  for (const event of [[0, 9, 1], [0, -1, 1], [0, 0], [0, 0, 1.01], [0, 0, NaN], [0, 0, '1'], [0, 1, 2], [0, 2, 1]]) {
    assert.throws(() => lab.replay({ values: [...lab.values], events: [[0, 2], event] }), RangeError, JSON.stringify(event))
    assert.deepEqual(bits(lab), there)
  }
})

test('a goal counts how long it is held, and only for who uses the controls alone', (t) => {
  const lab = made(t)
  assert.deepEqual(lab.goal, { held: 0, reached: null, counts: true })
  for (let i = 0; i < 4; i++) lab.press(2)
  lab.step(60)
  assert.ok(lab.goal.held > 0.1)
  assert.ok(lab.goal.reached >= 0.05 && lab.goal.reached < 0.1, String(lab.goal.reached))
  const { log, goal } = lab
  lab.replay(structuredClone(log))
  lab.step(60)
  assert.deepEqual(lab.goal, { ...goal, counts: false })
  lab.reset()
  assert.deepEqual(lab.goal, { held: 0, reached: null, counts: true })
})

const STATE = { values: [0.5, 3, null, null], steps: 7, time: 0.014, physics: new Float64Array([1 / 3]) }

test('a link carries the log; one that is too long leaves it out and says so', async () => {
  const log = { values: [0, 1, null, null], events: [[0, 1, 3], [0.002, 0, 0.1 + 0.2], [0.01, 2]] }
  const { link, only } = await writeLink('a', { ...STATE, log })
  assert.equal(only, null)
  assert.deepEqual((await readLink(link)).state, { ...STATE, log: { ...log, end: 0.014 } })
  const noise = Array.from({ length: 5000 }, (_, i) => [i / 500, 0, Math.sin(i)])
  const long = await writeLink('a', { ...STATE, log: { ...log, events: noise } })
  assert.deepEqual([long.only, (await readLink(long.link)).state], ['state', STATE])
  const dragged = await writeLink('a', { ...STATE, log: null })
  assert.deepEqual([dragged.only, (await readLink(dragged.link)).state], [null, STATE])
  assert.equal((await readLink((await writeLink('a', { ...STATE, steps: 0, log })).link)).state.log, undefined, 'nothing has moved')
})

test('of a link with a log that is none, the state is taken', async () => {
  const many = Array.from({ length: 10_001 }, () => [0, 0])
  const events = [[[]], [[0]], [[-1, 0]], [[0, 0.5, 1]], [['0', 0, 1]], [[0, 0, null]], [[0, 0, {}]], [[0, 0, 1, 1]], [null], [[null, 0]], 'ab', {}, null, many]
  const logs = [...events.map((one) => [[], one]), 1, 'ab', [], [[]], [[], [], []], [[{}], []], [[[]], []], { 0: [], 1: [], length: 2 }]
  for (const l of logs) {
    const bytes = deflateRawSync(Buffer.from(JSON.stringify({ v: [1], n: 2, t: 3, l })))
    const { state } = await readLink(`#lab=x&z=${bytes.toString('base64url')}`)
    assert.deepEqual(state, { values: [1], steps: 2, time: 3, physics: null }, JSON.stringify(l))
  }
})

test('a log is written as an author gives it', () => {
  const log = { values: [0.5, 1, null, null], events: [[0, 1, 3], [0.02, 2]] }
  assert.deepEqual(JSON.parse(`{${writeLog(log, CONTROLS)}}`), {
    log: [{ t: 0, do: { torque: 0.5 } }, { t: 0, do: { from: 3 } }, { t: 0.02, do: 'kick' }],
  })
  assert.equal(writeLog({ values: [0, 1, null, null], events: [] }, CONTROLS), '"log": []')
})
