/** Dragging a body: MuJoCo's spring, beside the author's own forces. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { FALLING, PENDULUM, control, labOf, newEngine } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

const WEIGHTLESS = FALLING.replace('<worldbody>', '<option gravity="0 0 0"/><worldbody>')

test('a free body comes to the target and stays there', (t) => {
  const lab = labOf(t, engine, WEIGHTLESS)
  lab.start()
  lab.perturb({ body: 1, point: [0, 0, 1], target: [0.3, 0.2, 1.5] })
  lab.step(2000)
  const [x, y, z] = lab.data.qpos
  assert.ok(Math.hypot(x - 0.3, y - 0.2, z - 1.5) < 1e-3, `${[x, y, z]}`)
  lab.perturb({ target: [0, 0, 1] })
  lab.step(2000)
  assert.ok(Math.hypot(lab.data.qpos[0], lab.data.qpos[1], lab.data.qpos[2] - 1) < 1e-3)
  lab.perturb(null)
  assert.equal(lab.drag.active, false)
})

test('the spring holds the point that was taken, not the centre', (t) => {
  const lab = labOf(t, engine, WEIGHTLESS)
  lab.start()
  lab.perturb({ body: 1, point: [0.1, 0, 1], target: [0.1, 0.5, 1] })
  lab.step(5)
  assert.ok(lab.data.qvel[1] > 0)
  assert.ok(lab.data.qvel[5] > 0, 'it turns about z')
})

test('the author keeps his forces, and sees only them', (t) => {
  const seen = []
  const lab = labOf(t, engine, WEIGHTLESS, {}, { controller: ({ data }) => void seen.push(data.xfrc_applied[8]) })
  lab.start()
  lab.data.xfrc_applied[8] = 4 // N along z on the ball of 2 kg
  lab.perturb({ body: 1, point: [0, 0, 1], target: [1, 0, 1] })
  lab.step(100)
  assert.ok(seen.every((force) => force === 4))
  assert.deepEqual([...lab.data.xfrc_applied.slice(6)], [0, 0, 4, 0, 0, 0])
  assert.ok(lab.data.qvel[0] > 0.1, 'the spring')
  assert.ok(lab.data.qvel[2] > 0.05, 'and the force')
  lab.perturb(null)
  lab.reset()
  lab.data.xfrc_applied[8] = 4
  lab.step(100)
  assert.ok(Math.abs(lab.data.qvel[2] - 0.4) < 1e-9)
})

test('what cannot move is not taken', (t) => {
  const lab = labOf(t, engine, '<mujoco><worldbody><body name="post"><geom size=".1"/></body></worldbody></mujoco>')
  lab.start()
  for (const body of [0, 1, 2, -1, undefined]) {
    lab.perturb({ body, point: [0, 0, 0], target: [1, 0, 0] })
    assert.equal(lab.drag.active, false)
  }
  lab.step(5)
})

test('a mocap body follows at once', (t) => {
  const lab = labOf(
    t,
    engine,
    '<mujoco><worldbody><body mocap="true" pos="0 0 1" euler="0 0 90"><geom size=".1"/></body></worldbody></mujoco>',
  )
  lab.start()
  lab.perturb({ body: 1, point: [0, 0.1, 1], target: [1, 0.1, 2] })
  assert.ok([...lab.data.mocap_pos].every((x, i) => Math.abs(x - [1, 0, 2][i]) < 1e-6), `${lab.data.mocap_pos}`)
})

test('a drag shows its spring, and ends with a reset', (t) => {
  const lab = labOf(t, engine, PENDULUM, { controls: [control({ value: 1 })] }, { controls: [{ set: () => {} }] })
  lab.start()
  lab.perturb({ body: 1, point: [0, 0, -0.3], target: [0.5, 0, -0.3] })
  lab.step(10)
  const frame = lab.frame()
  assert.equal(frame[3], 1)
  assert.ok(frame[1] > 0)
  lab.reset()
  assert.equal(lab.drag.active, false)
  assert.equal(lab.frame()[1], 0)
})

const held = (lab) => {
  const { xpos, xmat } = lab.data
  return [0, 1, 2].map((i) => xpos[3 + i] - 0.4 * xmat[9 + 3 * i + 2]) // of the arm: 0.4 m below its joint
}

test('while time stands still, the pose follows the hand as far as joints allow', (t) => {
  const limited = PENDULUM.replace('damping=".01"', 'range="-90 90" limited="true"')
  const lab = labOf(t, engine, limited)
  lab.start()
  lab.data.qvel[0] = 2
  lab.perturb({ body: 1, point: [0, 0, -0.4], target: [0.4 * Math.sin(1), 0, -0.4 * Math.cos(1)] }, true)
  assert.ok(Math.abs(lab.data.qpos[0] + 1) < 1e-3, `${lab.data.qpos[0]}: a positive angle turns it towards -x`)
  assert.deepEqual(held(lab).map((x) => x.toFixed(3)), ['0.337', '0.000', '-0.216'])
  assert.deepEqual([lab.data.qvel[0], lab.time], [2, 0])
  lab.perturb({ target: [9, 0, 0] }, true)
  assert.ok(Math.abs(lab.data.qpos[0] + Math.PI / 2) < 1e-3, 'it points to where it cannot reach')
  lab.perturb({ target: [0.1, 0, 0.4] }, true)
  assert.ok(lab.data.qpos[0] >= -Math.PI / 2 - 1e-12, 'within its range')
  assert.ok(!lab.log, 'no control did this')
  lab.perturb(null)
  lab.step(1)
  assert.ok(Number.isFinite(lab.data.qpos[0]))
})

test('what floats is moved as a whole, as by MuJoCo', (t) => {
  const xml = WEIGHTLESS.replace('<site', '<body pos="0 0 .2"><joint axis="0 1 0"/><geom size=".1"/></body><site')
  const lab = labOf(t, engine, xml)
  lab.start()
  lab.perturb({ body: 2, point: [0, 0, 1.2], target: [0.5, 0.25, 2] }, true)
  assert.deepEqual([...lab.data.qpos].map((x) => Number(x.toFixed(12))), [0.5, 0.25, 1.8, 1, 0, 0, 0, 0])
  assert.deepEqual([...lab.data.xfrc_applied], new Array(18).fill(0), 'no spring pulls')
})

test('an arm of three joints reaches a point that it can reach', (t) => {
  const link = (inner) => `<body pos=".3 0 0"><joint axis="0 1 0"/><joint axis="0 0 1"/><geom type="capsule" size=".02" fromto="0 0 0 .3 0 0"/>${inner}</body>`
  const lab = labOf(t, engine, `<mujoco><worldbody>${link(link(link('')))}</worldbody></mujoco>`)
  lab.start()
  const target = [0.5, 0.3, 0.4]
  lab.perturb({ body: 3, point: [1.2, 0, 0], target }, true)
  const { xpos, xmat } = lab.data
  const end = [0, 1, 2].map((i) => xpos[9 + i] + 0.3 * xmat[27 + 3 * i])
  assert.ok(Math.hypot(...end.map((x, i) => x - target[i])) < 1e-3, `${end}`)
})
