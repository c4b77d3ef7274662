/** Divergence is noticed at its step, told with its kind, and never passes as a reset. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { FALLING, PENDULUM, control, labOf, newEngine } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

// A spring that is far too stiff for the timestep of an explicit integrator.
const EXPLODING = `<mujoco><option timestep="0.1" integrator="RK4"/><worldbody>
  <body><joint name="j" type="slide" axis="1 0 0" stiffness="1e5"/><geom size=".1" mass="1"/></body></worldbody></mujoco>`

test('a blow-up ends the run where it happens', (t) => {
  const lab = labOf(t, engine, EXPLODING, {}, { setup: ({ data }) => (data.qpos[0] = 0.1) })
  lab.start()
  const { steps, stopped } = lab.step(10_000)
  assert.equal(stopped, 'diverged')
  assert.ok(steps < 50)
  assert.equal(lab.steps, steps)
  assert.match(lab.diverged.kind, /^badq(pos|vel|acc)$/)
  assert.ok(Math.abs(lab.diverged.time - steps * 0.1) < 1e-9, 'time goes on, MuJoCo has not reset it')
  assert.deepEqual(lab.step(10), { steps: 0, stopped: 'diverged' })
  lab.reset()
  assert.equal(lab.diverged, null)
  assert.equal(lab.step(1).stopped, null)
})

test('a blow-up is noticed though lab code allows the reset', (t) => {
  const lab = labOf(t, engine, EXPLODING, {}, {
    setup: ({ model, data, mj }) => {
      model.opt.disableflags &= ~mj.mjtDisableBit.mjDSBL_AUTORESET.value
      data.qpos[0] = 0.1
    },
  })
  lab.start()
  const { stopped } = lab.step(10_000)
  assert.equal(stopped, 'diverged')
  assert.match(lab.diverged.kind, /^badq(pos|vel|acc)$/)
})

test('values that lab code writes', (t) => {
  for (const [array, value, kind, message] of [
    ['qpos', NaN, 'badqpos', 'qpos[2] is NaN'],
    ['qpos', 2e10, 'badqpos', 'qpos[2] is 20000000000'],
    ['qvel', -Infinity, 'badqvel', 'qvel[2] is -Infinity'],
  ]) {
    const lab = labOf(
      t,
      engine,
      FALLING,
      { controls: [control({ type: 'button' }), control({ type: 'button' })] },
      { controls: [{ run: ({ data }) => (data[array][2] = value) }, { run: ({ data }) => data[array].fill(0) }] },
    )
    lab.start()
    lab.step(10)
    lab.press(0)
    assert.deepEqual([lab.diverged.kind, lab.diverged.message], [kind, message])
    assert.equal(lab.step(1).stopped, 'diverged')
    lab.press(1)
    assert.equal(lab.diverged, null, 'code has mended it')
    assert.equal(lab.step(1).steps, 1)
  }
})

test('a controller that breaks the state', (t) => {
  const lab = labOf(t, engine, FALLING, {}, { controller: ({ data }) => data.time > 0.1 && (data.qvel[0] = NaN) })
  lab.start()
  assert.equal(lab.step(1000).stopped, 'diverged')
  assert.equal(lab.diverged.kind, 'badqvel')
  assert.ok(lab.diverged.time > 0.1 && lab.diverged.time < 0.11)
})

test('a timestep that goes nowhere', (t) => {
  for (const timestep of [0, -0.001]) {
    const lab = labOf(t, engine, FALLING, {}, { setup: ({ model }) => (model.opt.timestep = timestep) })
    lab.start()
    assert.equal(lab.step(10).stopped, 'diverged')
    assert.equal(lab.diverged.kind, 'time')
  }
})

test('other warnings are told once a step and do not end the run', (t) => {
  const lab = labOf(t, engine, PENDULUM, {}, { controller: ({ data }) => (data.ctrl[0] = data.time > 0.1 ? NaN : 0) })
  lab.start()
  assert.equal(lab.step(100).stopped, null)
  const warnings = lab.takeWarnings()
  assert.equal(warnings[0].kind, 'badctrl')
  assert.ok(warnings[0].time > 0.1 && warnings[0].time < 0.11)
  assert.ok(warnings[0].message.length > 10 && !/\.$/.test(warnings[0].message))
  assert.deepEqual(lab.takeWarnings(), [])
})

test('too little memory for contacts is told', (t) => {
  const balls = Array.from({ length: 30 }, (_, i) => `<body pos="0 0 ${0.01 * i}"><freejoint/><geom size=".1"/></body>`)
  const lab = labOf(t, engine, `<mujoco><size memory="20K"/><worldbody><geom type="plane" size="1 1 1"/>${balls}</worldbody></mujoco>`)
  const attempt = () => {
    lab.start()
    lab.step(10)
  }
  // MuJoCo warns, or gives up when not even its own work fits: either way it is said.
  try {
    attempt()
    assert.ok(lab.takeWarnings().some(({ kind }) => kind === 'contactfull' || kind === 'cnstrfull'))
  } catch (error) {
    assert.match(error.message, /memory|stack|arena/i)
  }
})

test('what is read from memory is what the bindings say, also where these cannot write it', (t) => {
  const prototype = engine.mj.MjData.prototype
  const property = Object.getOwnPropertyDescriptor(prototype, 'ncon')
  Object.defineProperty(prototype, 'ncon', { ...property, set: undefined })
  t.after(() => Object.defineProperty(prototype, 'ncon', property))
  const lab = labOf(t, engine, FALLING.replace('<worldbody>', '<worldbody><geom type="plane" size="1 1 .1" pos="0 0 -1"/>'))
  lab.start()
  const { numbers } = lab.watch
  const contacts = new Set()
  for (let i = 0; i < 400; i++) {
    lab.step(5)
    contacts.add(numbers.contacts)
    assert.deepEqual([numbers.time, numbers.timestep, numbers.contacts], [lab.data.time, lab.option.timestep, lab.data.ncon])
  }
  assert.ok(contacts.size > 1)
})
