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
