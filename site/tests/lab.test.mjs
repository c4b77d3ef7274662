/** When a lab's code runs, what it sees, and what it cannot disturb. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { OVERLAYS } from '../js/lab/core/frame.js'
import { LabError } from '../js/lab/core/piece.js'
import { FALLING, PENDULUM, control, labOf, newEngine, plot } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

test('the order at the start and at a reset', (t) => {
  const calls = []
  const note = (name) => (env, value) => void calls.push([name, value, env.ctx.p])
  const lab = labOf(
    t,
    engine,
    PENDULUM,
    {
      controls: [
        control({ label: 'plain', value: 1 }),
        control({ label: 'init', value: 2, init: true }),
        control({ label: 'param', value: 3, param: 'p' }),
        control({ label: 'unset' }),
        control({ label: 'list', type: 'select', options: [['a', 'A'], ['b', 'B']] }),
        control({ label: 'button', type: 'button' }),
      ],
    },
    {
      setup: note('setup'),
      controls: [
        { set: note('plain') },
        { set: note('init') },
        { set: ({ ctx }, value) => (ctx.p = value) },
        { set: note('unset') },
        { set: note('list') },
        { run: note('button') },
      ],
    },
  )
  lab.start()
  assert.deepEqual(calls.splice(0), [
    ['plain', 1, 3],
    ['list', 'A', 3],
    ['setup', undefined, 3],
    ['init', 2, 3],
  ])
  lab.ctx.p = 'overwritten by lab code'
  lab.reset()
  assert.deepEqual(calls.splice(0), [
    ['setup', undefined, 3],
    ['init', 2, 3],
  ])
  lab.setControl(1, 5)
  assert.deepEqual(calls.splice(0), [['init', 5, 3]])
  lab.setControl(3, 7)
  lab.press(5)
  assert.deepEqual(calls.splice(0), [
    ['unset', 7, 3],
    ['button', undefined, 3],
  ])
  lab.reset()
  assert.deepEqual(calls.splice(0).at(-1), ['init', 5, 3])
  assert.deepEqual(lab.values, [1, 5, 3, 7, 'A', null])
})

test('a control with `reset` starts again with its new value', (t) => {
  const lab = labOf(
    t,
    engine,
    PENDULUM,
    { controls: [control({ label: 'q', value: 0.5, param: 'q', reset: true }), control({ value: 1 })] },
    {
      setup: ({ data, ctx }) => (data.qpos[0] = ctx.q),
      controls: [{ set: ({ ctx }, value) => (ctx.q = value) }, { set: ({ data }, value) => (data.qvel[0] = value) }],
    },
  )
  lab.start()
  assert.deepEqual([lab.data.qpos[0], lab.data.qvel[0]], [0.5, 1])
  lab.step(10)
  lab.setControl(0, -0.25)
  assert.deepEqual([lab.data.qpos[0], lab.data.qvel[0], lab.time], [-0.25, 0, 0])
  lab.step(10)
  lab.setControl(1, 3)
  assert.equal(lab.data.qvel[0], 3)
  assert.ok(lab.time > 0)
})

test('keyframes by name and by number, and one that is not there', (t) => {
  for (const key of ['up', 0]) {
    const lab = labOf(t, engine, PENDULUM, { key })
    lab.start()
    assert.equal(lab.data.qpos[0], 3)
  }
  for (const key of ['down', 1, -1, 0.5]) {
    assert.throws(() => labOf(t, engine, PENDULUM, { key }), { message: `the model has no keyframe ${JSON.stringify(key)}` })
  }
})

test('values that a control cannot have are refused and change nothing', (t) => {
  const lab = labOf(
    t,
    engine,
    PENDULUM,
    {
      controls: [
        control({ label: 'torque', min: -1, max: 1, value: 0 }),
        control({ label: 'list', type: 'select', options: [['a', 1], ['b', 2]], value: 2 }),
        control({ label: 'button', type: 'button' }),
      ],
    },
    { controls: [{ set: ({ data }, v) => (data.ctrl[0] = v) }, { set: () => {} }, { run: () => {} }] },
  )
  lab.start()
  for (const [i, value] of [[0, NaN], [0, '1'], [0, null], [1, 3], [1, 'a'], [2, 1], [3, 1]]) {
    assert.throws(() => lab.setControl(i, value), RangeError)
  }
  assert.throws(() => lab.press(0), RangeError)
  assert.deepEqual(lab.values, [0, 2, null])
})

test('lab code sees live arrays, also after the memory of the engine has grown', (t) => {
  const lab = labOf(t, engine, FALLING, {}, { readouts: [({ data }) => data.qpos[2]] })
  lab.start()
  const { data } = lab.env
  const size = data.qpos.buffer.byteLength
  const ballast = []
  while (data.qpos.buffer.byteLength === size) ballast.push(new engine.mj.DoubleBuffer(1 << 18))
  ballast.forEach((buffer) => buffer.delete())
  data.qpos[2] = 7
  assert.equal(data.qpos[2], 7)
  lab.step(1)
  assert.ok(lab.data.qpos[2] < 7 && lab.data.qpos[2] > 6.99)
  assert.equal(lab.diverged, null)
  lab.data.qvel[0] = NaN
  assert.equal(lab.step(1).stopped, 'diverged')
})

test('arrays of booleans can be read and written', (t) => {
  const lab = labOf(
    t,
    engine,
    `<mujoco><worldbody><light/><body name="a"><freejoint/><geom size=".1"/></body></worldbody>
     <equality><weld body1="a"/></equality></mujoco>`,
  )
  lab.start()
  const { data, model } = lab.env
  assert.deepEqual([...data.eq_active], [1])
  lab.step(100)
  assert.ok(data.qpos[2] > -0.01, 'the weld holds it')
  data.eq_active[0] = 0
  lab.step(100)
  assert.ok(data.qpos[2] < -0.1, 'it falls')
  assert.deepEqual([...model.light_active], [1])
})

test('what is shown belongs to one moment', (t) => {
  const lab = labOf(
    t,
    engine,
    FALLING,
    {},
    { readouts: [({ data }) => data.qpos[2] - data.xpos[5], ({ lib }) => lib.bodyPos('ball')[2]] },
  )
  lab.start()
  lab.step(100)
  const [gap, height] = lab.readouts()
  assert.equal(gap, 0)
  assert.equal(height, lab.data.qpos[2])
  assert.notEqual(lab.data.xpos[5], height, 'in the simulation itself it is a step behind, as mj_step leaves it')
})

test('looking changes no bit of the motion, with contact, sensors, a controller that reads them, in any integrator', (t) => {
  for (const integrator of ['Euler', 'RK4', 'implicit', 'implicitfast', 'discrete']) {
    const xml = `<mujoco><option integrator="${integrator}"/><worldbody><geom type="plane" size="1 1 .1"/>
      <body pos="0 0 .3" euler="10 20 30"><freejoint/><geom type="box" size=".1 .1 .1"/><site name="s"/></body>
      <body pos="0 1 1"><joint name="h" axis="0 1 0"/><geom type="capsule" size=".05 .2" pos=".2 0 0"/></body></worldbody>
      <actuator><position joint="h" kp="10" kv="1"/></actuator>
      <sensor><accelerometer site="s"/><jointpos joint="h"/><subtreeangmom body="world"/></sensor></mujoco>`
    const finish = (look) => {
      const lab = labOf(
        t,
        engine,
        xml,
        { overlays: OVERLAYS, arrows: { width: 0.01, momentum: 1, angularMomentum: 1, axis: 1 } },
        {
          controller: ({ data, lib }) => (data.ctrl[0] = 0.1 * data.sensordata[2] + lib.sitePos('s')[2]),
          readouts: [({ lib }) => lib.energy().total, ({ lib }) => lib.norm(lib.angmom()), ({ lib }) => lib.normalForce()],
        },
      )
      lab.start()
      for (let i = 0; i < 400; i++) {
        lab.step(1)
        if (look(i)) {
          lab.readouts()
          lab.frame()
          lab.scene()
        }
      }
      return lab.state().physics
    }
    assert.deepEqual(finish((i) => i % 7 === 0), finish(() => false), integrator)
  }
})

test('a readout that writes changes nothing, and one that acts is refused', (t) => {
  const lab = labOf(
    t,
    engine,
    FALLING,
    {},
    { readouts: [({ data }) => (data.qpos[2] = 100), ({ mj, model, data }) => (mj.mj_resetData(model, data), 1)] },
  )
  lab.start()
  lab.step(10)
  const before = lab.state().physics
  lab.readouts()
  lab.step(0)
  assert.deepEqual(lab.state().physics, before)
  for (const name of ['play', 'pause', 'reset', 'step']) {
    const other = labOf(t, engine, FALLING, {}, { readouts: [({ sim }) => sim[name]()] })
    other.start()
    assert.throws(() => other.readouts(), {
      entry: ['readouts', 0, 'expr'],
      message: `Error: sim.${name}() is not for code that only looks`,
    })
  }
})

test('errors of lab code name their entry', (t) => {
  const broken = () => nothing.there // eslint-disable-line no-undef
  const message = 'ReferenceError: nothing is not defined'
  const data = {
    controls: [control({ type: 'button' }), control({ value: 1 })],
    readouts: [{}, {}],
    plots: [plot(1), plot(2)],
  }
  const fine = () => 1
  const make = (fields) =>
    labOf(t, engine, FALLING, data, {
      controls: [{ run: fine }, { set: fine }],
      readouts: [fine, fine],
      plots: [[fine], [fine, fine]],
      ...fields,
    })
  const fails = (fields, entry, act) => {
    const lab = make(fields)
    assert.throws(() => act(lab), (error) => {
      assert.ok(error instanceof LabError)
      assert.deepEqual([error.entry, error.message, error.kind], [entry, message, 'throws'])
      return true
    })
  }
  const start = (lab) => lab.start()
  fails({ setup: broken }, ['setup'], start)
  fails({ controls: [{ run: fine }, { set: broken }] }, ['controls', 1], start)
  fails({ plots: [[fine], [fine, broken]] }, ['plots', 1, 'traces', 1, 'expr'], start)
  fails({ plots: [[fine, broken], [fine, fine]] }, ['plots', 0, 'x'], start)
  fails({ controller: broken }, ['controller'], (lab) => (lab.start(), lab.step(1)))
  fails({ controls: [{ run: broken }, { set: fine }] }, ['controls', 0, 'run'], (lab) => (lab.start(), lab.press(0)))
  fails({ readouts: [fine, broken] }, ['readouts', 1, 'expr'], (lab) => (lab.start(), lab.readouts()))
})

test('values of the wrong kind are told', (t) => {
  for (const [value, kind] of [
    [undefined, 'undefined'],
    [[1, 2], 'an array of 2'],
    [new Float64Array(3), 'an array of 3'],
    [{}, 'an object'],
    [true, 'boolean true'],
    [() => 1, 'a function'],
  ]) {
    const lab = labOf(t, engine, FALLING, { readouts: [{}] }, { readouts: [() => value] })
    lab.start()
    assert.throws(() => lab.readouts(), { kind: 'type', message: `gives ${kind}, not a number or a text` })
  }
  const lab = labOf(t, engine, FALLING, { plots: [plot(1)] }, { plots: [[() => 'text']] })
  assert.throws(() => lab.start(), { kind: 'type', message: 'gives the text "text", not a number' })
})

test('stopAt stops at the step that reaches it, once', (t) => {
  for (const [timestep, stopAt] of [[0.002, 5], [0.0023, 1], [0.01, 0.3]]) {
    const lab = labOf(t, engine, FALLING.replace('<worldbody>', `<option timestep="${timestep}"/><worldbody>`), { stopAt })
    lab.start()
    const { steps, stopped } = lab.step(100_000)
    assert.equal(stopped, 'stopAt')
    assert.equal(steps, Math.round(stopAt / timestep))
    assert.deepEqual(lab.step(10), { steps: 10, stopped: null })
    lab.reset()
    assert.equal(lab.step(100_000).stopped, 'stopAt')
  }
})

test('sim: step, reset, pause and play', (t) => {
  const calls = []
  const lab = labOf(
    t,
    engine,
    PENDULUM,
    { key: 'up', controls: ['step', 'reset', 'nested'].map((label) => control({ label, type: 'button' })) },
    {
      controller: ({ sim, data }) => {
        if (data.time > 0.5) sim.pause()
      },
      controls: [
        { run: ({ sim }) => sim.step(100) },
        { run: ({ sim, data }) => (sim.reset(), (data.qvel[0] = 2)) },
        { run: ({ sim }) => sim.play() },
      ],
    },
    { play: () => calls.push('play'), pause: () => calls.push('pause') },
  )
  lab.start()
  lab.press(0)
  assert.ok(Math.abs(lab.time - 0.2) < 1e-9)
  lab.press(1)
  assert.deepEqual([lab.time, lab.data.qpos[0], lab.data.qvel[0]], [0, 3, 2])
  const { steps, stopped } = lab.step(1000)
  assert.deepEqual([steps, stopped, calls], [251, 'code', ['pause']])
  lab.press(2)
  assert.deepEqual(calls, ['pause', 'play'])
  const nested = labOf(t, engine, PENDULUM, {}, { controller: ({ sim }) => sim.step() })
  nested.start()
  assert.throws(() => nested.step(1), { entry: ['controller'], message: 'Error: sim.step() within a step is not possible' })
  nested.code.controller = () => {}
  assert.equal(nested.step(1).steps, 1, 'it can go on')
})

test('samples lie on a grid of steps, start anew with every run, and do not depend on how the steps are dealt out', (t) => {
  const record = (portion) => {
    const data = { key: 'up', controls: [control({ type: 'button' })], plots: [plot(1, { window: 2 }), plot(1)] }
    const lab = labOf(t, engine, PENDULUM, data, {
      plots: [[({ data }) => data.qpos[0]], [({ data }) => data.time]],
      controls: [{ run: ({ mj, model, data }) => mj.mj_resetData(model, data) }],
    })
    lab.start()
    for (let done = 0; done < 1000; ) done += lab.step(Math.min(portion, 1000 - done)).steps
    const taken = lab.sampler.take()
    return { lab, taken }
  }
  const { lab, taken } = record(1000)
  assert.deepEqual(record(7).taken, taken)
  assert.equal(taken.times.length, 501)
  assert.equal(taken.values.length, 1002)
  assert.deepEqual([...taken.times.slice(0, 2)], [0, 0.004])
  for (let i = 0; i < 501; i++) assert.equal(taken.values[2 * i + 1], taken.times[i])
  assert.deepEqual(lab.sampler.take().times.length, 0)
  lab.step(10)
  lab.press(0) // lab code puts the time back by itself
  const after = lab.sampler.take()
  assert.notEqual(after.epoch, taken.epoch)
  assert.deepEqual([...after.times], [0])
})

test('a state goes to another lab of the same kind and on from there to the last bit', (t) => {
  const make = () =>
    labOf(
      t,
      engine,
      PENDULUM,
      { key: 'up', controls: [control({ value: 0.1, init: true, min: -1, max: 1 }), control({ value: 2 })] },
      { controls: [{ set: ({ data }, v) => (data.ctrl[0] = v) }, { set: ({ model }, v) => (model.dof_damping[0] = v) }] },
    )
  const motion = (lab) => ({ ...lab.state(), log: null })
  const first = make()
  first.start()
  first.setControl(0, 0.7)
  first.setControl(1, 0.5)
  first.step(123)
  const state = structuredClone(first.state())
  const second = make()
  second.start()
  second.restore(state)
  assert.deepEqual(motion(second), motion(first))
  first.step(500)
  second.step(500)
  assert.deepEqual(motion(second), motion(first))
  assert.throws(() => second.restore({ values: [], physics: new Float64Array(3) }), RangeError)
})

test('chance is the same again after a reset and depends on the seed', (t) => {
  const draws = (seed) => {
    const lab = labOf(t, engine, FALLING, { seed }, { setup: ({ lib, ctx }) => (ctx.draws = [lib.random(), lib.random()]) })
    lab.start()
    const first = lab.ctx.draws
    lab.reset()
    assert.deepEqual(lab.ctx.draws, first)
    return first
  }
  assert.deepEqual(draws(3), draws(3))
  assert.notDeepEqual(draws(3), draws(4))
  assert.ok(draws(null).every((x) => x >= 0 && x < 1))
})
