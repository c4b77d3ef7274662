/** The trial finds what is wrong in a lab, says where, and says the same each time. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { crc32 } from '../js/lab/trial/parity.js'
import { Guard } from '../js/lab/trial/guard.js'
import { runTrial } from '../js/lab/trial/trial.js'
import { FALLING, PENDULUM, compile, config, control, newEngine, plot } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

const READOUT = [{ label: 'r', digits: 3 }]
const HEAD = '({model, data, mj, sim, ctx, lib})'

/** Try a lab; its pieces are texts: expressions for readouts, plots and claims, statements for the rest. */
function attempt(xml, data, pieces = {}, request = {}) {
  const statements = (text) => `${HEAD} => { ${text} }`
  const list = (texts) => `[${(texts ?? []).map((text) => `${HEAD} => (${text})`).join(', ')}]`
  const members = [
    ...['setup', 'controller'].filter((name) => pieces[name]).map((name) => `${name}: ${statements(pieces[name])}`),
    `controls: [${(pieces.controls ?? []).join(', ')}]`,
    `readouts: ${list(pieces.readouts)}`,
    `plots: [${(pieces.plots ?? []).map(list).join(', ')}]`,
    `expect: ${list(pieces.expect)}`,
    ...(pieces.goal ? [`goal: ${HEAD} => (${pieces.goal})`] : []),
  ]
  const code = `({${members.join(', ')}})`
  let clock = 0
  const { guard = null, tick = 0.01, ...rest } = request
  return runTrial(engine, { config: config(data), code, ...rest }, compile(engine, xml), () => (clock += tick), guard)
}

const set = (target) => `{set: (${HEAD.slice(1, -1)}, value) => { (${target}) = value }}`
const run = (text) => `{run: ${HEAD} => { ${text} }}`
const told = ({ failures }) => failures.map(({ entry, kind, message, at }) => [entry.join('.'), kind, message, at])

test('a sound lab passes, and everything in it is tried', () => {
  const reply = attempt(
    PENDULUM,
    {
      key: 'up',
      controls: [
        control({ label: 'torque', min: -0.5, max: 0.5, value: 0.1, init: true }),
        control({ label: 'kick', type: 'button' }),
        control({ label: 'from', type: 'select', options: [['low', 1], ['high', 3]], value: 3, reset: true, param: 'from' }),
      ],
      readouts: [...READOUT, ...READOUT],
      plots: [plot(2)],
      expect: [
        { after: [], t: 0, min: 3, max: 3 },
        { after: [{ from: 1 }], t: 0, min: 1, max: 1 },
        { after: ['kick'], t: 0.1, min: null, max: 100 },
      ],
      stopAt: 2,
    },
    {
      setup: 'data.qpos[0] = ctx.from',
      controls: [set('data.ctrl[0]'), run('data.qvel[0] += 1'), '{set: ({ctx}, value) => { ctx.from = value }}'],
      readouts: ['data.qpos[0]', '"text"'],
      plots: [['data.qpos[0]', 'lib.energy().total']],
      expect: ['data.qpos[0]', 'data.qpos[0]', 'data.qvel[0]'],
    },
  )
  assert.deepEqual(told(reply), [])
  assert.deepEqual(
    reply.tried.map(({ entry, what }) => `${entry.join('.')}: ${what}`),
    [
      ': start',
      'controls.0: "torque" at its minimum -0.5',
      'controls.0: "torque" at its maximum 0.5',
      'controls.0: "torque" at its value 0.1',
      'controls.1: button "kick"',
      'controls.2: "from" at "low"',
      'controls.2: "from" at "high"',
      'expect.0: claims from the start',
      'expect.1: claims with "from" at 1',
      'expect.2: claims after "kick"',
    ],
  )
  const { main } = reply
  assert.deepEqual([main.stopped, main.steps, main.resetDiffers], ['stopAt', 1000, null])
  assert.ok(Math.abs(main.seconds - 2) < 1e-9)
  assert.equal(main.plots.times.length, 126)
  assert.deepEqual(main.plots.plots.map((traces) => traces.map((values) => values.length)), [[126, 126]])
  assert.deepEqual(main.pictures.map(({ readouts }) => readouts[1]), ['text', 'text'])
  assert.equal(main.pictures[0].readouts[0], 3)
  assert.equal(main.scene.geoms[0].name, 'bob')
  assert.equal(reply.version, engine.version)
  assert.ok(reply.stepsPerSecond > 0)
})

test('steps before a claim are done in order, and claims after the same share a run', () => {
  const claims = [
    [[{ at: 5 }, 'add'], 2, 6],
    [['add', { at: 5 }], 0, 5],
    [[{ at: 5 }, 'add'], 0, 6],
    [[{ at: 4 }, { at: 5 }], 0, 5],
    [['add', 'add'], 0, 5],
  ]
  const reply = attempt(
    PENDULUM,
    {
      controls: [control({ label: 'at', min: 3, max: 5, value: 3, param: 'at' }), control({ label: 'add', type: 'button' })],
      expect: claims.map(([after, t, value]) => ({ after, t, min: value, max: value })),
    },
    { controls: ['{set: ({ctx}, value) => { ctx.at = value }}', run('ctx.at += 1')], expect: claims.map(() => 'ctx.at') },
    { seconds: 0.1 },
  )
  assert.deepEqual(told(reply), [])
  assert.deepEqual(
    reply.tried.slice(-4).map(({ entry, what }) => `${entry.join('.')}: ${what}`),
    [
      'expect.2: claims after "at" at 5, then "add"',
      'expect.1: claims after "add", then "at" at 5',
      'expect.3: claims after "at" at 4, then "at" at 5',
      'expect.4: claims after "add", then "add"',
    ],
  )
})

test('a goal is not reached by doing nothing, and by its log it is', () => {
  const GOAL = 'Math.abs(data.qvel[0]) > 5'
  const goal = (expr, hold, log, stopAt = 1) =>
    told(
      attempt(
        PENDULUM,
        { controls: [control({ label: 'torque', min: -1, max: 1, value: 0 }), control({ label: 'kick', type: 'button' })], goal: { hold, log }, stopAt },
        { controls: [set('data.ctrl[0]'), run('data.qvel[0] += 6')], goal: expr },
      ),
    ).map(([entry, kind, message]) => [entry, kind, message])
  assert.deepEqual(goal(GOAL, 0, [[0.4, 1]]), [])
  assert.deepEqual(goal(GOAL, 0, [[0, 0, 0], [3, 1]]), [], 'after the time at which the lab stops')
  assert.deepEqual(goal('data.time > 0.5', 0, []), [], 'a goal that is waited for')
  assert.deepEqual(goal(GOAL, 1, [[0.4, 1]]), [
    ['goal.log', 'goal', 'by 2.4 s: it is held for 0.128 s at the most, not 1 s'],
  ])
  assert.deepEqual(goal(GOAL, 0, [[0, 0, 0.1]]), [['goal.log', 'goal', 'by 1 s: its condition is never true']])
  assert.deepEqual(goal('data.time >= 0', 0, [[0.4, 1]]), [['goal.expr', 'goal', 'at the start']])
  assert.deepEqual(goal('data.time >= 0', 0, []), [['goal.expr', 'goal', 'at the start']])
  assert.deepEqual(goal('data.time > 2.001', 0, [[3, 1]]), [['goal.expr', 'goal', 'with nothing done, at 2.016 s']])
  assert.deepEqual(goal('data.qpos[0]', 0, []), [['goal.expr', 'type', 'gives number 0, not true or false']])
  assert.deepEqual(goal('0 / data.qpos[0]', 0, []), [['goal.expr', 'type', 'gives number NaN, not true or false']])
  assert.deepEqual(goal('lib.none()', 0, []), [['goal.expr', 'throws', 'TypeError: lib.none is not a function']])
  assert.deepEqual(goal(GOAL, 0, [[0, 0, 2]]), [['goal.log', 'throws', 'the control "torque" cannot be set to 2']])
})

test('the same request gives the same reply', () => {
  const one = () => {
    const reply = attempt(PENDULUM, { key: 'up', plots: [plot(1)], seed: 5 }, {
      controller: 'data.ctrl[0] = lib.random()',
      plots: [['data.qpos[0]']],
    })
    return JSON.stringify({ ...reply, stepsPerSecond: 0 })
  }
  assert.equal(one(), one())
})

test('each way to be wrong, with its entry', () => {
  const cases = [
    [{}, { setup: 'nowhere.x = 1' }, [['setup', 'throws', 'ReferenceError: nowhere is not defined', 0]]],
    [{}, { setup: 'oops = 1' }, [['setup', 'throws', 'ReferenceError: oops is not defined', 0]]],
    [{}, { controller: 'lib.sitePos("none")' }, [['controller', 'throws', 'Error: the model has no site "none"', 0]]],
    [{ readouts: READOUT }, { readouts: ['data.qpos[99]'] }, [['readouts.0.expr', 'type', 'gives undefined, not a number or a text', 0]]],
    [{ readouts: READOUT }, { readouts: ['0 / 0'] }, [['readouts.0.expr', 'nan', 'is NaN', 0]]],
    [{ readouts: READOUT }, { readouts: ['1 / (0.1 - Math.min(0.1, data.time))'] }, [['readouts.0.expr', 'nan', 'is Infinity', 0.1]]],
    [{ plots: [plot(2)] }, { plots: [['1', '"x"']] }, [['plots.0.traces.1.expr', 'type', 'gives the text "x", not a number', 0]]],
    [{ plots: [plot(1)] }, { plots: [['Math.sqrt(-1)']] }, [['plots.0.traces.0.expr', 'nan', 'is NaN', 0]]],
    [
      { expect: [{ after: [], t: 1, min: 0, max: null }] },
      { expect: ['data.qpos[2]'] },
      [['expect.0.expr', 'expect', /^is -3\.9\d* at 1 s, less than 0$/, 1]],
    ],
    [{ expect: [{ after: [], t: 1, min: null, max: -5 }] }, { expect: ['data.qpos[2]'] }, [['expect.0.expr', 'expect', /more than -5$/, 1]]],
    [
      { expect: [{ after: [], t: 0, min: 0, max: 1 }] },
      { expect: ['"0.5"'] },
      [['expect.0.expr', 'type', 'gives the text "0.5", not a number', 0]],
    ],
    [{ expect: [{ after: ['nothing'], t: 0, min: 0, max: 1 }] }, { expect: ['0'] }, [['expect.0', 'throws', 'there is no control "nothing"', 0]]],
    [{ key: 'none' }, {}, [['', 'throws', 'the model has no keyframe "none"', null]]],
    [{ trail: 'none' }, {}, [['', 'throws', 'the model has no site "none"', null]]],
  ]
  for (const [data, pieces, wanted] of cases) {
    const found = told(attempt(FALLING, data, pieces, { seconds: 1 }))
    const rounded = found.map(([entry, kind, message, at]) => [entry, kind, message, at === null ? null : Math.round(100 * at) / 100])
    const what = JSON.stringify([data, pieces])
    assert.equal(rounded.length, wanted.length, `${what}: ${JSON.stringify(rounded)}`)
    rounded.forEach((failure, i) => {
      const [entry, kind, message, at] = wanted[i]
      assert.deepEqual([failure[0], failure[1], failure[3]], [entry, kind, at], what)
      if (message instanceof RegExp) assert.match(failure[2], message)
      else assert.equal(failure[2], message, what)
    })
  }
})

test('a control that only fails at an end', () => {
  const reply = attempt(
    FALLING,
    { controls: [control({ label: 'g', min: 0, max: 1e9, value: 10 }), control({ label: 'b', type: 'button' })], readouts: READOUT },
    {
      controls: [set('model.opt.gravity[2]'), run('data.qpos[2] = NaN')],
      readouts: ['data.qpos[2] > 1e6 ? lib.none() : 1'],
    },
    { seconds: 0.1 },
  )
  const failures = reply.failures.map(({ entry, kind, during }) => [entry.join('.'), kind, during.what])
  assert.deepEqual(failures, [
    ['readouts.0.expr', 'throws', '"g" at its maximum 1000000000'],
    ['controls.1', 'diverged', 'button "b"'],
  ])
})

test('warnings and divergence', () => {
  const reply = attempt(PENDULUM, {}, { controller: 'if (data.time > 0.1) data.ctrl[0] = NaN' }, { seconds: 1 })
  assert.deepEqual(reply.failures.map(({ kind }) => kind), ['warning'])
  assert.ok(reply.failures[0].at > 0.1 && reply.failures[0].at < 0.11)
  const blown = attempt(FALLING, {}, { controller: 'if (data.time > 0.1) data.qvel[2] = 1e12' }, { seconds: 1 })
  assert.deepEqual(blown.failures.map(({ kind, entry }) => [kind, entry]), [['diverged', []]])
  assert.ok(blown.main.seconds < 0.2)
})

const PRESS = `<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
  <body pos="0 0 .1"><joint type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body></worldbody></mujoco>`

test('bodies deep in each other are noticed, of which MuJoCo does not warn', () => {
  const pressed = (force, xml = PRESS) =>
    attempt(xml, {}, { controller: `data.qfrc_applied[0] = -${force}` }, { seconds: 0.5 }).failures
  assert.deepEqual(pressed(5000).map(({ entry, kind }) => [entry, kind]), [[[], 'deep']])
  assert.match(pressed(5000)[0].message, /^`floor` and geom 1 by 0\.1\d* m$/)
  assert.deepEqual(pressed(300), [])
  const plate = PRESS.replace('size=".1" mass', 'type="box" size=".1 .1 1e-4" mass').replace('0 0 .1"', '0 0 1e-4"')
  assert.deepEqual(pressed(300, plate).map(({ kind }) => kind), ['deep'])
  assert.deepEqual(pressed(5000, PRESS.replace('type="plane"', 'type="plane" contype="0" conaffinity="0"')), [])
})

test('bodies that the author has put into each other are not remarked on before a step', () => {
  const inside = PRESS.replace('pos="0 0 .1"', 'pos="0 0 -.2"')
  assert.deepEqual(attempt(inside, {}, { setup: 'data.qpos[0] = -.1', controller: 'data.qpos[0] = 1' }, { seconds: 0.1 }).failures, [])
})

test('a value that is not there is `null`, or written as it is', () => {
  const late = (value) => `data.time > 0.1 ? 1 : ${value}`
  const reply = attempt(
    PENDULUM,
    { readouts: [...READOUT, ...READOUT, ...READOUT], plots: [plot(2)] },
    { readouts: ['null', 'NaN', '-Infinity'], plots: [[late('null'), late('Infinity')]] },
    { seconds: 0.2 },
  )
  assert.deepEqual(told(reply), [])
  const { readouts } = JSON.parse(JSON.stringify(reply.main.pictures[1]))
  assert.deepEqual(readouts, [null, null, '−∞'])
  const [gap, infinite] = JSON.parse(JSON.stringify(reply.main.plots.plots))[0]
  assert.deepEqual([gap[0], gap.at(-1), infinite[0], infinite.at(-1)], [null, 1, null, 1])
})

test('a lab that is to diverge proves it, and nothing of a time after it', () => {
  const blow = 'data.qvel[0] *= 10 ** (1e6 * data.time)'
  const claim = (t, diverges) => ({ after: [], t, min: diverges ? null : -1e300, max: null, diverges })
  const expect = [claim(0, false), claim(1, true), claim(2, false)]
  const reply = attempt(PENDULUM, { expect }, { setup: 'data.qvel[0] = 1', controller: blow, expect: ['data.time', '0', 'data.time'] })
  const failures = told(reply).map(([entry, kind]) => [entry, kind])
  assert.deepEqual(failures, [['', 'diverged'], ['expect.1', 'diverged'], ['expect.2', 'diverged']])
  assert.ok(reply.main.diverged && reply.main.parity.steps > 0)
  const sound = attempt(PENDULUM, { expect: [claim(0.1, true)] }, { expect: ['0'] })
  assert.deepEqual(told(sound).map(([entry, kind]) => [entry, kind]), [['expect.0', 'expect']])
  assert.equal(sound.main.diverged, false)
})

test('where a run takes no millisecond of the clock, the run that is timed once more tells nothing of the last claim', () => {
  const expect = [
    { after: [], t: 1, diverges: true, min: null, max: null },
    { after: [{ mend: 1 }], t: 1, min: null, max: 1 },
  ]
  const controls = [control({ label: 'mend', min: 0, max: 1, value: 0, reset: true, param: 'mend' })]
  const pieces = {
    controller: 'if (data.time > 0.1 && !ctx.mend) data.qvel[0] = NaN',
    controls: ['{set: ({ctx}, value) => { ctx.mend = value }}'],
    expect: ['0', '0'],
  }
  for (const tick of [0.01, 0]) {
    const entries = attempt(PENDULUM, { controls, expect }, pieces, { tick }).failures.map(({ entry }) => entry.join('.'))
    assert.deepEqual(entries, ['', 'controls.0', 'expect.0'])
  }
})

test('a state that is no number can be drawn, even in the first picture that has something to draw', () => {
  const blow = 'if (data.time > 0.05) data.qvel[0] = 1e200'
  const reply = attempt(PENDULUM, { overlays: ['frames'] }, { controller: blow, setup: 'data.qpos[0] = NaN' }, { seconds: 0.1 })
  assert.deepEqual(reply.failures.map(({ kind }) => kind), ['diverged'])
})

test('a reset that does not lead back is noticed, with the entry that would have to set the number', () => {
  const differs = (data, pieces) => {
    const reply = attempt(FALLING, data, pieces, { seconds: 0.1 })
    assert.deepEqual(told(reply), [])
    return reply.main.resetDiffers
  }
  const slider = (fields) => control({ label: 's', min: 0, max: 1, value: 0.5, ...fields })
  assert.deepEqual(differs({}, { setup: 'data.qvel[0] = Math.random()' }), { what: 'qvel[0]', entry: ['setup'] })
  assert.deepEqual(differs({}, { setup: 'ctx.n = (ctx.n ?? 0) + 1; data.qpos[2] = ctx.n' }), { what: 'qpos[2]', entry: ['setup'] })
  const two = [slider(), slider()]
  assert.deepEqual(differs({ controls: two }, { controls: [set('model.opt.gravity[2]'), set('data.qvel[1]')] }), {
    what: 'qvel[1]',
    entry: ['controls', 1],
  })
  const initial = '{set: ({ctx, data}, value) => { data.xfrc_applied[8] = value + (ctx.n = (ctx.n ?? 0) + 1) }}'
  assert.deepEqual(differs({ controls: [slider({ init: true })] }, { controls: [initial] }), {
    what: 'xfrc_applied[8]',
    entry: ['controls', 0],
  })
  assert.deepEqual(differs({}, { controller: 'model.qpos0[2] = 2' }), { what: 'qpos[2]', entry: [] })
  assert.deepEqual(differs({}, { controller: 'ctx.late = 3', setup: 'data.time = ctx.late ?? 0' }), { what: 'time', entry: ['setup'] })
})

test('a reset leads back where it should', () => {
  for (const [data, pieces] of [
    [{ seed: 3 }, { setup: 'data.qvel[0] = lib.random()', controller: 'data.xfrc_applied[6] = lib.random()' }],
    [{ controls: [control({ label: 's', min: 0, max: 1, value: 0.5, init: true })] }, { controls: [set('data.qvel[1]')] }],
    [{ controls: [control({ label: 's', min: 1, max: 3, value: 2 })] }, { controls: [set('model.body_mass[1]')] }],
    [{ controls: [control({ label: 's', min: 1, max: 3, value: 2, param: 'p' })] }, { controls: ['{set: ({ctx}, value) => { ctx.p = value }}'], setup: 'data.qvel[1] = ctx.p' }],
  ]) {
    const { main } = attempt(FALLING, data, pieces, { seconds: 0.1 })
    assert.equal(main.resetDiffers, null, JSON.stringify([data, pieces]))
  }
})

const SHARED = [['JSON', JSON, false], ['Math', Math, false], ['Array', Array, false], ['Error', Error, false]]

test('what a lab changes of that which all share is told at its entry, and put back', () => {
  const button = control({ label: 'b', type: 'button' })
  const slider = control({ label: 's', min: 0, max: 1, value: 0.5 })
  for (const [data, pieces, entry, names] of [
    [{}, { setup: 'Math.sin = () => 0' }, 'setup', '`Math.sin`'],
    [{}, { setup: 'mj.mj_step = () => {}' }, 'setup', '`mj.mj_step`'],
    [{}, { setup: 'JSON.stringify = null' }, 'setup', '`JSON.stringify`'],
    [{}, { setup: 'delete Array.prototype.map; null.x' }, 'setup', '`Array.prototype.map`'],
    [{}, { controller: 'if (data.time > 0.05) Array.prototype.last = 3' }, 'controller', '`Array.prototype.last`'],
    [{ controls: [button] }, { controls: [run('Object.setPrototypeOf(Math, null); mj.mj_step = 3')] }, 'controls.0.run', '`Math.__proto__`, `mj.mj_step`'],
    [{ controls: [slider] }, { controls: ['{set: (_, value) => { if (value === 1) Math.max = Math.min }}'] }, 'controls.0', '`Math.max`'],
    [{ readouts: READOUT }, { readouts: ['(Math[Symbol.iterator] = 1)'] }, 'readouts.0.expr', '`Math[Symbol(Symbol.iterator)]`'],
    [{ plots: [plot(1)] }, { plots: [['(mj.MjData.prototype.x = 1)']] }, 'plots.0.traces.0.expr', '`mj.MjData.prototype.x`'],
    [{ expect: [{ after: [], t: 0, min: 0, max: 9 }] }, { expect: ['(Object.defineProperty(Math, "PI", {}), Error.stackTraceLimit = 3)'] }, 'expect.0.expr', '`Error.stackTraceLimit`'],
  ]) {
    const guard = new Guard([...SHARED, ['mj', engine.mj, true]])
    const { sin, max } = Math
    const limit = Error.stackTraceLimit
    const reply = attempt(FALLING, data, pieces, { seconds: 0.1, guard })
    const what = JSON.stringify([data, pieces])
    assert.deepEqual(told(reply), [[entry, 'shared', names, null]], what)
    assert.deepEqual(guard.changes(), [], what)
    assert.deepEqual([Math.sin, Math.max, typeof [].map, Error.stackTraceLimit], [sin, max, 'function', limit])
  }
})

test('a lab that keeps to itself changes nothing of what all share', () => {
  const guard = new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
  const reply = attempt(
    PENDULUM,
    { key: 'up', seed: 1, readouts: READOUT, plots: [plot(1)], overlays: ['frames'], controls: [control({ label: 'b', type: 'button' })] },
    {
      setup: 'ctx.list = [3, 1].sort().map((x) => x); class A extends Error {}; A.prototype.x = 1; new A().name = "b"',
      readouts: ['`${new Map([[1, 2]]).get(1)}${/a(b)/.test("ab")}${RegExp.$1}`'],
      plots: [['[...new Set([1, 2])].length + new mj.MjVFS().delete() ?? 0']],
      controls: [run('ctx.big = new mj.DoubleBuffer(1 << 22); ctx.big.delete()')],
    },
    { seconds: 0.1, guard },
  )
  assert.deepEqual(guard.changes(), [])
  assert.deepEqual(told(reply).filter(([, kind]) => kind === 'shared'), [])
})

test('a model that does not load', () => {
  const reply = runTrial(engine, { config: config(), code: '({controls: [], readouts: [], plots: [], expect: []})' }, new Uint8Array(9), () => 0)
  assert.deepEqual(told(reply), [['', 'engine', 'the model does not load: Failed to load from mjb', null]])
  assert.equal(reply.main, null)
})

test('an engine that ends is told, and not used again', () => {
  const reply = attempt(
    FALLING,
    { controls: ['a', 'b', 'c'].map((label) => control({ label, type: 'button' })) },
    { controls: [run('1'), run('throw new WebAssembly.RuntimeError("unreachable")'), run('1')] },
    { seconds: 0.1 },
  )
  assert.deepEqual(reply.failures.map(({ entry, kind }) => [entry, kind]), [[['controls', 1, 'run'], 'engine']])
  assert.deepEqual(reply.tried.map(({ what }) => what), ['start', 'button "a"'])
})

test('what parity needs: the start, what a controller wrote, and the way', () => {
  const { main } = attempt(PENDULUM, { key: 'up' }, { controller: 'data.ctrl[0] = Math.round(5 * data.time) % 2' }, { seconds: 1 })
  const { parity } = main
  const array = ({ type, data }) => {
    const bytes = Uint8Array.from(Buffer.from(data, 'base64'))
    const kinds = { f64: Float64Array, i32: Int32Array, u32: Uint32Array }
    return [...new kinds[type](bytes.buffer, bytes.byteOffset, bytes.byteLength / kinds[type].BYTES_PER_ELEMENT)]
  }
  assert.deepEqual([parity.steps, parity.stride, parity.width, parity.complete, parity.modelChanged], [500, 1, 2, true, false])
  assert.equal(array(parity.checksums).length, 500)
  assert.equal(array(parity.states).length, 1000)
  const writes = array(parity.writes.steps)
  assert.equal(writes.length, 5, 'only what has changed')
  assert.deepEqual(array(parity.writes.values), [1, 0, 1, 0, 1])
  assert.equal(new Set(array(parity.writes.indices)).size, 1)
  const last = array(parity.states).slice(-2)
  assert.equal(crc32(new Float64Array(last), 0), array(parity.checksums).at(-1))
  const changing = attempt(PENDULUM, {}, { controller: 'model.dof_damping[0] = data.time' }, { seconds: 0.1 })
  assert.equal(changing.main.parity.modelChanged, true)
  assert.equal(attempt(PENDULUM, {}, {}, { seconds: 0.1, parity: false }).main.parity, null)
})

test('CRC-32 is that of zlib', () => {
  assert.equal(crc32(new TextEncoder().encode('123456789'), 0), 0xcbf43926)
  assert.equal(crc32(new TextEncoder().encode('6789'), crc32(new TextEncoder().encode('12345'), 0)), 0xcbf43926)
})
