/** The tape: every step of a run is found again to the last bit, whatever shaped the run, and memory stays bounded. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Tape } from '../js/lab/core/tape.js'
import { PENDULUM, control, labOf, newEngine, plot } from './helpers.mjs'

const engine = await newEngine()
const BALLS = `<mujoco><option timestep="0.004"/><worldbody><geom type="plane" size="2 2 .1"/>
  ${[0.2, 0.45, 0.7].map((z, i) => `<body pos="${0.05 * i} 0 ${z}"><freejoint/><geom size=".1"/><site name="s${i}"/></body>`).join('')}
</worldbody><sensor><framepos objtype="site" objname="s2"/></sensor></mujoco>`

const taped = (t, xml, data, functions) => {
  const lab = labOf(t, engine, xml, data, functions)
  lab.tape = new Tape(lab)
  lab.start()
  return lab
}

/** All that a reader or the next step could see of a lab. */
const whole = (lab) => ({
  physics: lab.physics.read(),
  derived: [lab.data.xpos, lab.data.sensordata, lab.data.qacc].map((array) => array.slice()),
  ctx: structuredClone(lab.ctx),
  values: [...lab.values],
  goal: lab.goal,
  time: lab.time,
  steps: lab.steps,
})

// A controller that remembers, draws random numbers, and sees sensors of the step before.
const CONTROLLER = ({ data, ctx, lib }) => {
  ctx.sum = (ctx.sum ?? 0) + data.sensordata[2] + lib.random()
  data.xfrc_applied[6] = 0.01 * ctx.sum * ctx.gain
}
const GAIN = { controls: [control({ param: 'gain', min: 0, max: 9, value: 1 }), control({ type: 'button' })] }
const CODE = {
  controller: CONTROLLER,
  controls: [{ set: ({ ctx }, value) => (ctx.gain = value) }, { run: ({ data }) => (data.qvel[2] += 1) }],
}

test('every step is found again to the last bit, also after controls were used', (t) => {
  const lab = taped(t, BALLS, GAIN, CODE)
  const seen = [whole(lab)]
  for (let i = 1; i <= 200; i++) {
    lab.step(1)
    if (i === 61) lab.setControl(0, 4)
    if (i === 130) lab.press(1)
    seen.push(whole(lab))
  }
  assert.ok(lab.tape.states.length < 60, `${lab.tape.states.length} states of 200 steps`)
  for (const step of [200, 3, 60, 61, 62, 199, 130, 129, 0, 131, 77]) {
    lab.tape.go(step)
    assert.deepEqual(whole(lab), seen[step], `step ${step}`)
  }
  assert.deepEqual(
    lab.tape.range.marks.map(([time, i]) => [time.toFixed(3), i]),
    [['0.244', 0], ['0.520', 1]],
  )
  lab.tape.seek(seen[150].time)
  assert.equal(lab.steps, 150)
  lab.tape.seek(1e9)
  assert.equal(lab.steps, 200)
  lab.tape.seek(-1)
  assert.equal(lab.steps, 0)
})

test('a controller that changes the model is repeated, too', (t) => {
  const controller = ({ data, model }) => (model.opt.gravity[0] = Math.sin(9 * data.time) + data.sensordata[2])
  const lab = taped(t, BALLS, {}, { controller })
  const seen = [lab.physics.read()]
  for (let i = 0; i < 100; i++) {
    lab.step(1)
    seen.push(lab.physics.read())
  }
  for (const step of [99, 4, 50, 51, 52, 53, 100]) {
    lab.tape.go(step)
    assert.deepEqual(lab.physics.read(), seen[step])
  }
})

test('what changes the model for good, a button or a controller, leaves the steps before it as they were', (t) => {
  const fields = { controls: [control({ type: 'button' })] }
  const run = ({ model, mj, data }) => {
    model.opt.gravity[2] = 5
    model.opt.timestep = 0.003
    model.body_mass[1] *= 3
    mj.mj_setConst(model, data)
  }
  const controller = ({ data, model }) => {
    if (data.time > 0.7) model.geom_size[3] = 0.05
  }
  const lab = taped(t, BALLS, fields, { controller, controls: [{ run }] })
  const seen = [whole(lab)]
  for (let i = 1; i <= 300; i++) {
    lab.step(1)
    if (i === 150) lab.press(0)
    seen.push(whole(lab))
  }
  assert.ok(lab.tape.states.length < 60)
  for (const step of [20, 149, 150, 151, 300, 199, 3, 250]) {
    lab.tape.go(step)
    assert.deepEqual(whole(lab), seen[step], `step ${step}`)
  }
  lab.tape.go(100)
  lab.step(1)
  assert.deepEqual(whole(lab), seen[101], 'what goes on from there has the model of that time')
})

test('a run that goes on from an earlier step goes as it went before', (t) => {
  const lab = taped(t, BALLS, GAIN, CODE)
  const other = taped(t, BALLS, GAIN, CODE)
  lab.step(150)
  other.step(150)
  lab.tape.go(43)
  assert.ok(lab.tape.isPast)
  lab.step(107)
  assert.ok(!lab.tape.isPast)
  assert.deepEqual(whole(lab), whole(other))
})

test('what is done at an earlier step drops what came after, from the log too', (t) => {
  const lab = taped(t, BALLS, GAIN, CODE)
  lab.step(50)
  lab.setControl(0, 2)
  lab.step(50)
  lab.setControl(0, 3)
  lab.step(50)
  lab.tape.go(70)
  assert.equal(lab.values[0], 2)
  assert.deepEqual(lab.state().log.events, [[0.2, 0, 2]])
  assert.equal(lab.tape.range.end.toFixed(3), '0.600', 'looking drops nothing')
  lab.step(0)
  assert.equal(lab.tape.range.end.toFixed(3), '0.280')
  lab.press(1)
  assert.equal(lab.tape.range.end.toFixed(3), '0.280')
  assert.deepEqual(lab.state().log.events, [[0.2, 0, 2], [0.28, 1]])
  const { log } = lab.state()
  lab.step(30)
  const reached = lab.physics.read()
  const again = taped(t, BALLS, GAIN, CODE)
  again.replay({ ...log, end: lab.time })
  while (again.step(1).stopped === null);
  assert.deepEqual(again.physics.read(), reached)
})

test('samples, trail and goal go back with the run', (t) => {
  const fields = { plots: [plot(1, { window: 1 })], trail: 's0', goal: { hold: 0 } }
  const lab = taped(t, BALLS, fields, { plots: [[({ data }) => data.qpos[2]]], goal: ({ data }) => data.time > 0.3 })
  lab.step(100)
  assert.ok(lab.goal.reached !== null)
  const { length } = lab.sampler.take().times
  const points = lab.sampler.points
  lab.tape.seek(0.2)
  assert.equal(lab.goal.reached, null)
  assert.ok(lab.sampler.points < points)
  assert.equal(lab.sampler.take().from, Infinity)
  lab.step(1)
  assert.ok(Math.abs(lab.sampler.take().from - 0.2) < 1e-9)
  lab.step(49)
  assert.ok(lab.sampler.take().times.length < length)
  assert.ok(lab.goal.reached !== null)
  assert.equal(lab.sampler.points, points)
})

test('where a hand pulled, the run stands still at its states only', (t) => {
  const lab = taped(t, PENDULUM)
  lab.step(100)
  lab.perturb({ body: 1, point: [0, 0, -0.4], target: [0.2, 0, -0.3] })
  const seen = []
  for (let i = 0; i < 100; i++) {
    lab.step(1)
    seen[lab.steps] = lab.physics.read()
  }
  lab.perturb(null)
  lab.step(100)
  for (const step of [299, 150, 101, 100, 177]) {
    lab.tape.go(step)
    assert.ok(lab.steps <= step && step - lab.steps < lab.tape.stride, `${lab.steps} for ${step}`)
    if (seen[lab.steps] && lab.steps < 200) assert.deepEqual(lab.physics.read(), seen[lab.steps])
  }
})

test('a long run with many changes keeps few states, and those are true', (t) => {
  const lab = taped(t, PENDULUM, { controls: [control({ min: -9, max: 9, value: 0 })] }, { controls: [{ set: ({ data }, value) => (data.ctrl[0] = value) }] })
  lab.tape.most = 100
  const seen = []
  for (let i = 0; i < 3000; i++) {
    if (i % 7 === 0 && i < 2000) lab.setControl(0, i % 5)
    lab.step(1)
    seen[lab.steps] = lab.physics.read()
  }
  assert.ok(lab.tape.states.length <= 100)
  for (const step of [2999, 2500, 1400, 33]) {
    lab.tape.go(step)
    if (lab.steps === step) assert.deepEqual(lab.physics.read(), seen[step])
    else assert.ok(step < 2000 && lab.steps <= step)
  }
})

test('functions, the engine\'s arrays and objects that hold themselves are no hindrance', (t) => {
  const setup = ({ ctx, data, lib }) => {
    Object.assign(ctx, { law: (x) => -3 * x, angle: data.qpos, seen: new Map(), hinge: lib.jointId('hinge'), ring: new Float64Array(3) })
    ctx.self = ctx
  }
  const controller = ({ ctx, data }) => {
    ctx.ring[ctx.seen.size % 3] = ctx.law(ctx.angle[ctx.hinge])
    ctx.seen.set(Math.round(1e6 * data.time), ctx.ring[0])
    data.ctrl[0] = Math.max(-1, Math.min(1, ctx.ring[1] + ctx.self.seen.size / 100))
  }
  const lab = taped(t, PENDULUM, {}, { setup, controller })
  lab.setPaused(true)
  const seen = [[lab.physics.read(), 0]]
  for (let i = 1; i <= 200; i++) {
    lab.step(1)
    seen.push([lab.physics.read(), lab.ctx.seen.size])
  }
  for (const step of [199, 33, 150, 2, 200]) {
    lab.tape.go(step)
    assert.deepEqual([lab.physics.read(), lab.ctx.seen.size], seen[step])
  }
})

test('a lab that keeps what cannot be copied, or too much, has no tape, and runs as ever', (t) => {
  class Filter {}
  for (const make of [() => new Filter(), () => new Date(0), () => new Array(1e9), () => new Float64Array(6000), () => new DataView(new ArrayBuffer(8))]) {
    const lab = taped(t, PENDULUM, {}, { setup: ({ ctx }) => (ctx.kept = make()) })
    lab.step(100)
    const { start, end } = lab.tape.range
    assert.deepEqual([start, end], [lab.time, lab.time])
    lab.tape.seek(0)
    assert.equal(lab.steps, 100)
    lab.reset()
    assert.equal(lab.time, 0)
  }
})

test('what a lab keeps itself is counted, so that the tape of a long run stays small', (t) => {
  const lab = taped(t, PENDULUM, {}, { setup: ({ ctx }) => (ctx.delays = new Float64Array(4000)), controller: ({ ctx, data }) => (ctx.delays[99] = data.time) })
  lab.step(20_000)
  const { states } = lab.tape
  const numbers = states.reduce((sum, { numbers, before, model, ctx }) => sum + [numbers, before, model, ctx.delays].reduce((count, list) => count + (list?.length ?? 0), 0), 0)
  assert.ok(numbers < 1_100_000, `${numbers} numbers`)
  assert.ok(states.length > 100, `${states.length} states`)
  lab.tape.seek(17)
  assert.ok(Math.abs(lab.ctx.delays[99] - 17 + 0.002) < 1e-9)
})

test('when bodies begin or cease to touch is noted, once in a while, and forgotten with what came after', (t) => {
  const lab = taped(t, '<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .5"><freejoint/><geom size=".1"/></body></worldbody></mujoco>')
  lab.step(100)
  assert.deepEqual(lab.tape.range.touches, [])
  lab.step(400)
  const [fall] = lab.tape.range.touches
  assert.ok(Math.abs(fall - Math.sqrt(0.8 / 9.81)) < 0.01, `${fall} s`)
  lab.tape.seek(fall)
  assert.ok(lab.sync().data.ncon > 0)
  lab.tape.seek(fall - 0.05)
  assert.equal(lab.sync().data.ncon, 0)
  lab.step(1)
  assert.deepEqual(lab.tape.range.touches, [])
})
