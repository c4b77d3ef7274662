/** The worker: loading, real time, frames and buffers, errors. Its surroundings are made up here; the engine is the real one. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Host } from '../js/lab/worker/host.js'
import { FALLING, PENDULUM, code, compile, config, control, loadMujoco, newEngine, plot, wasm } from './helpers.mjs'

/** A worker in a time of its own, in which a step takes `cost` ms. */
class Bench {
  constructor({ cost = 0, models = { falling: FALLING, pendulum: PENDULUM }, codes = {} } = {}) {
    this.time = 1000
    this.queue = []
    this.messages = []
    this.drawn = []
    this.fetched = []
    this.host = new Host({
      loadMujoco,
      now: () => this.time,
      later: (action, ms) => this.queue.push({ at: this.time + ms, action }),
      post: (message, transfer) => {
        const arrived = structuredClone(message, { transfer })
        this.messages.push(arrived)
        if (arrived.type === 'frame') this.drawn.push(arrived)
      },
      fetchBytes: async (url) => {
        this.fetched.push(url)
        if (!(url in models)) throw new Error(`${url}: 404 Not Found`)
        return compile(await this.compiler, models[url])
      },
      importModule: async (url) => {
        if (!(url in codes)) throw new Error(`${url}: no module`)
        return codes[url]
      },
      compile: async () => wasm,
    })
    this.compiler = newEngine()
    this.cost = cost
  }

  send(message) {
    this.host.receive(message)
  }

  /** Load a lab and wait until it is there. */
  async load(lab, fields = {}, functions = 'plain', mjb = 'falling') {
    this.send({ type: 'load', lab, config: config(fields), module: functions, mjb, wasm: 'wasm' })
    while (!this.messages.some((m) => m.lab === lab && ['ready', 'error'].includes(m.type))) await new Promise(setImmediate)
    const session = this.host.sessions.get(lab)
    if (!session?.lab) return
    const step = session.lab.stepOnce.bind(session.lab)
    session.lab.stepOnce = () => {
      this.time += this.cost
      return step()
    }
  }

  /** Let time go by; the page draws every 16 ms and gives buffers back then, if `drawing`. */
  run(ms, drawing = true) {
    const end = this.time + ms
    let draw = drawing ? this.time : end
    while (this.time < end) {
      this.queue.sort((a, b) => a.at - b.at)
      const next = Math.min(draw, this.queue[0]?.at ?? Infinity)
      this.time = Math.max(this.time, next)
      if (drawing && draw <= this.time) {
        for (const { lab, buffer } of this.drawn.splice(0)) this.send({ type: 'frame', lab, buffer })
        draw = Math.max(draw + 16, this.time)
      }
      if (this.queue[0]?.at <= this.time) this.queue.shift().action()
    }
  }

  of(type, lab) {
    return this.messages.filter((m) => m.type === type && (lab === undefined || m.lab === lab))
  }

  take() {
    return this.messages.splice(0).map(({ type, lab }) => `${type} ${lab}`)
  }
}

const plain = code()

test('a lab becomes ready, shows itself, and waits', async () => {
  const bench = new Bench({ codes: { plain: code({ readouts: [({ data }) => data.qpos[2]] }) } })
  await bench.load('a', { readouts: [{}] })
  assert.deepEqual(bench.messages.map(({ type }) => type), ['ready', 'frame'])
  const [ready, frame] = bench.messages
  assert.equal(ready.version, '3.14.0')
  assert.equal(ready.scene.geoms[0].name, 'ball')
  assert.deepEqual(frame.readouts, [1])
  assert.equal(new Float32Array(frame.buffer)[0] <= frame.buffer.byteLength / 4, true)
  bench.run(100)
  assert.equal(bench.messages.length, 2, 'nothing moves, nothing is sent')
})

test('it keeps real time, at any speed, and draws once for each refresh', async () => {
  for (const [factor, seconds] of [[1, 2], [0.25, 2], [4, 1]]) {
    const bench = new Bench({ codes: { plain } })
    await bench.load('a')
    bench.send({ type: 'speed', lab: 'a', factor })
    bench.send({ type: 'play', lab: 'a' })
    bench.take()
    bench.run(1000 * seconds)
    const frames = bench.of('frame')
    const { time, realtime } = frames.at(-1)
    assert.ok(Math.abs(time - factor * seconds) < 0.03 * factor, `${time} s at ${factor}`)
    assert.ok(realtime > 0.999)
    assert.ok(Math.abs(frames.length - 1000 * seconds / 16) < 8, `${frames.length} frames`)
    assert.ok(frames.every((f, i) => i === 0 || f.time > frames[i - 1].time))
  }
})

test('a slow model runs slower, says so, and leaves the worker free for messages', async () => {
  const bench = new Bench({ cost: 8, codes: { plain } })
  await bench.load('a')
  bench.send({ type: 'play', lab: 'a' })
  bench.run(3000)
  const { time, realtime } = bench.of('frame').at(-1)
  assert.ok(Math.abs(realtime - 0.25) < 0.02, `realtime ${realtime}`)
  assert.ok(Math.abs(time - 0.75) < 0.05, `${time} s`)
  assert.ok(bench.of('frame').length > 80)
  bench.send({ type: 'pause', lab: 'a' })
  assert.equal(bench.messages.at(-1).type, 'paused')
})

test('two labs share the worker', async () => {
  const bench = new Bench({ cost: 1, codes: { plain } })
  await bench.load('a')
  await bench.load('b', {}, 'plain', 'pendulum')
  for (const lab of ['a', 'b']) bench.send({ type: 'play', lab })
  bench.run(2000)
  for (const lab of ['a', 'b']) {
    const { time } = bench.of('frame', lab).at(-1)
    assert.ok(time > 1.8, `${lab}: ${time} s`)
  }
  bench.send({ type: 'dispose', lab: 'a' })
  bench.take()
  bench.run(500)
  assert.deepEqual([...new Set(bench.take())], ['frame b'])
})

test('without buffers there are no frames, and the time goes on', async () => {
  const bench = new Bench({ codes: { plain } })
  await bench.load('a')
  bench.send({ type: 'play', lab: 'a' })
  bench.take()
  bench.run(1000, false)
  assert.equal(bench.of('frame').length, 0, 'one is under way since it was loaded')
  for (const buffer of [bench.drawn[0].buffer, null]) {
    bench.send({ type: 'frame', lab: 'a', buffer })
    bench.run(50, false)
  }
  assert.equal(bench.of('frame').length, 2)
  assert.ok(bench.of('frame')[0].time > 0.9)
})

test('out of sight nothing is computed; back in sight it goes on where it was', async () => {
  const bench = new Bench({ codes: { plain } })
  await bench.load('a')
  bench.send({ type: 'play', lab: 'a' })
  bench.run(500)
  bench.take()
  bench.send({ type: 'visible', lab: 'a', on: false })
  bench.run(5000)
  assert.deepEqual(bench.messages.map(({ type, reason }) => [type, reason]), [['paused', 'offscreen']])
  bench.take()
  bench.send({ type: 'visible', lab: 'a', on: true })
  bench.run(500)
  assert.equal(bench.messages[0].type, 'playing')
  assert.ok(bench.of('frame').at(-1).time < 1.1)
  bench.send({ type: 'pause', lab: 'a' })
  bench.take()
  bench.send({ type: 'visible', lab: 'a', on: false })
  bench.send({ type: 'visible', lab: 'a', on: true })
  assert.deepEqual(bench.take(), [], 'what is paused stays paused')
})

test('samples come whole and in order', async () => {
  const bench = new Bench({ codes: { plain: code({ plots: [[({ data }) => data.time]] }) } })
  await bench.load('a', { plots: [plot(1)] })
  bench.send({ type: 'play', lab: 'a' })
  bench.run(2000)
  const { samples } = bench.of('frame')[0]
  const times = bench.of('frame').flatMap((frame) => [...frame.samples.times])
  assert.deepEqual(times, bench.of('frame').flatMap((frame) => [...frame.samples.values]))
  assert.ok(times.length > 115)
  times.forEach((time, i) => assert.ok(Math.abs(time - 0.016 * i) < 1e-9))
  bench.send({ type: 'reset', lab: 'a' })
  bench.run(100)
  const { samples: after } = bench.of('frame').at(-1)
  assert.notEqual(after.epoch, samples.epoch)
})

test('controls, buttons, steps, states', async () => {
  const codes = {
    plain: code({
      controls: [{ set: ({ data }, value) => (data.qvel[2] = value) }, { run: ({ sim }) => sim.play() }, { run: ({ sim }) => sim.pause() }],
    }),
  }
  const bench = new Bench({ codes })
  const controls = [control({ label: 'v', value: 1, init: true }), ...['go', 'halt'].map((label) => control({ label, type: 'button' }))]
  await bench.load('a', { controls })
  assert.deepEqual(bench.of('ready')[0].values, [1, null, null])
  bench.send({ type: 'control', lab: 'a', index: 0, value: 3 })
  assert.deepEqual(bench.of('controls').at(-1).values, [3, null, null])
  bench.send({ type: 'step', lab: 'a', n: 5 })
  bench.send({ type: 'state', lab: 'a' })
  const { state } = bench.of('state')[0]
  assert.deepEqual([state.values, state.steps], [[3, null, null], 5])
  bench.send({ type: 'press', lab: 'a', index: 1 })
  bench.run(100)
  bench.send({ type: 'press', lab: 'a', index: 2 })
  assert.deepEqual(bench.messages.filter(({ type }) => ['playing', 'paused'].includes(type)).map(({ type, reason }) => [type, reason]), [
    ['playing', undefined],
    ['paused', 'code'],
  ])
  bench.send({ type: 'restore', lab: 'a', state })
  bench.send({ type: 'state', lab: 'a' })
  assert.deepEqual(bench.of('state')[1].state, { ...state, log: null })
  bench.send({ type: 'replay', lab: 'a', log: { ...state.log, end: state.time } })
  bench.run(1000)
  assert.deepEqual(bench.of('paused').at(-1).reason, 'stopAt')
  assert.deepEqual(bench.of('controls').at(-1).values, [3, null, null])
  bench.send({ type: 'state', lab: 'a' })
  assert.deepEqual(bench.of('state')[2].state, { ...state, log: { ...state.log, replayed: true } })
  const before = bench.of('playing').length
  bench.send({ type: 'press', lab: 'a', index: 2, play: true })
  assert.equal(bench.of('playing').length, before, 'its code pauses')
  bench.send({ type: 'control', lab: 'a', index: 0, value: 2, play: true })
  assert.equal(bench.of('playing').length, before + 1)
})

test('stopAt and divergence pause', async () => {
  const codes = { plain, broken: code({ controller: ({ data }) => data.time > 0.2 && (data.qvel[0] = NaN) }) }
  const bench = new Bench({ codes })
  await bench.load('a', { stopAt: 0.5, autoplay: true })
  bench.run(2000)
  assert.deepEqual(bench.of('paused')[0].reason, 'stopAt')
  assert.ok(Math.abs(bench.of('frame').at(-1).time - 0.5) < 1e-9)
  await bench.load('b', { autoplay: true }, 'broken')
  bench.run(1000)
  assert.deepEqual([bench.of('diverged').length, bench.of('diverged')[0].kind], [1, 'badqvel'])
  assert.equal(bench.of('paused', 'b')[0].reason, 'diverged')
  bench.take()
  bench.send({ type: 'play', lab: 'b' })
  bench.run(100)
  assert.deepEqual(bench.of('playing'), [])
  bench.send({ type: 'reset', lab: 'b' })
  bench.send({ type: 'play', lab: 'b' })
  bench.run(100)
  assert.equal(bench.of('playing').length, 1)
})

test('what lab code throws is told with its entry and pauses the lab, once', async () => {
  const broken = () => {
    throw new Error('no')
  }
  const codes = {
    controller: code({ controller: ({ data }) => data.time > 0.1 && broken() }),
    readout: code({ readouts: [({ data }) => (data.time > 0.1 ? broken() : 1)] }),
    trace: code({ plots: [[({ data }) => (data.time > 0.1 ? broken() : 1)]] }),
    button: code({ controls: [{ run: broken }] }),
    setup: code({ setup: broken }),
  }
  const entries = { controller: ['controller'], readout: ['readouts', 0, 'expr'], trace: ['plots', 0, 'traces', 0, 'expr'] }
  for (const [name, entry] of Object.entries(entries)) {
    const bench = new Bench({ codes })
    await bench.load('a', { autoplay: true, plots: name === 'trace' ? [plot(1)] : [] }, name)
    bench.run(1000)
    const errors = bench.of('error')
    assert.deepEqual(errors.map((e) => [e.message, e.entry, e.kind, e.fatal]), [['Error: no', entry, 'throws', false]], name)
    assert.equal(bench.of('paused')[0].reason, 'error')
  }
  const bench = new Bench({ codes })
  await bench.load('a', { controls: [control({ type: 'button' })], autoplay: true }, 'button')
  bench.send({ type: 'press', lab: 'a', index: 0 })
  assert.deepEqual(bench.of('error').map(({ entry }) => entry), [['controls', 0, 'run']])
  await bench.load('b', { autoplay: true }, 'setup')
  assert.deepEqual(bench.of('error', 'b').map(({ entry }) => entry), [['setup']])
  assert.equal(bench.of('ready', 'b').length, 1, 'it can still be seen')
  assert.equal(bench.of('playing', 'b').length, 0)
})

test('an engine that ends is told as fatal', async () => {
  const end = () => {
    throw new WebAssembly.RuntimeError('unreachable')
  }
  const bench = new Bench({ codes: { plain: code({ controller: ({ data }) => data.time > 0.1 && end() }) } })
  await bench.load('a', { autoplay: true })
  bench.run(1000)
  assert.deepEqual(bench.of('error').map(({ kind, fatal, entry }) => [kind, fatal, entry]), [['engine', true, ['controller']]])
  assert.equal(bench.of('paused')[0].reason, 'error')
})

test('an impossible message is refused and disturbs nothing', async () => {
  const bench = new Bench({ codes: { plain: code({ controls: [{ set: () => {} }] }) } })
  await bench.load('a', { autoplay: true, controls: [control({ value: 1 })] })
  const bad = [
    { type: 'control', index: 0, value: NaN },
    { type: 'control', index: 7, value: 1 },
    { type: 'press', index: 0 },
    { type: 'speed', factor: -1 },
    { type: 'overlay', name: 'heat', on: true },
    { type: 'restore', state: { values: [], physics: new Float64Array(2) } },
  ]
  for (const message of bad) bench.send({ lab: 'a', ...message })
  assert.deepEqual(bench.of('error').map(({ kind, fatal }) => [kind, fatal]), bad.map(() => ['refused', false]))
  assert.deepEqual(bench.of('paused'), [])
  assert.throws(() => bench.send({ type: 'dance', lab: 'a' }), { message: 'the worker knows no message "dance"' })
  bench.send({ type: 'play', lab: 'unknown' })
})

test('what cannot be loaded is told; messages that came early are not lost, and those for a lab that is gone are', async () => {
  const bench = new Bench({ codes: { plain } })
  await bench.load('a', {}, 'plain', 'missing')
  await bench.load('b', {}, 'missing')
  await bench.load('c', { key: 'none' })
  assert.deepEqual(bench.of('error').map(({ lab, message }) => `${lab}: ${message}`), [
    'a: the lab does not load: missing: 404 Not Found',
    'b: the lab does not load: missing: no module',
    'c: the model has no keyframe "none"',
  ])
  bench.take()
  bench.send({ type: 'load', lab: 'd', config: config(), module: 'plain', mjb: 'falling', wasm: 'wasm' })
  bench.send({ type: 'play', lab: 'd' })
  await bench.load('e')
  bench.run(100)
  assert.equal(bench.of('playing', 'd').length, 1)
  bench.send({ type: 'load', lab: 'f', config: config(), module: 'plain', mjb: 'falling', wasm: 'wasm' })
  bench.send({ type: 'dispose', lab: 'f' })
  await bench.load('g')
  assert.deepEqual(bench.messages.filter(({ lab }) => lab === 'f'), [])
})

test('a model that the reader wrote is compiled here; what MuJoCo says of it is told, and what is too much is refused', async () => {
  const bench = new Bench({ codes: { plain } })
  const world = (text) => `<mujoco>\n<worldbody>${text}</worldbody>\n</mujoco>`
  for (const [xml, wrong] of [
    [world('<geom size="1"/>'), null],
    [world('\n<geom size="1" foo="2"/>'), /unrecognized attribute: 'foo'\nElement 'geom', line 3/],
    [world('<goem/>'), /unrecognized element\nElement 'goem', line 2/],
    [world('<geom>'), /MISMATCHED_ELEMENT .* Line number=2/s],
    ['', /empty/],
    ['<mujoco><include file="a.xml"/></mujoco>', /opening file 'a.xml'\nElement 'include', line 1/],
    ['<mujoco><asset><mesh file="a.stl"/></asset></mujoco>', /opening file 'a.stl'/],
    ['<mujoco><extension><plugin plugin="a.b"/></extension></mujoco>', /plugin a.b not found/],
    ['<mujoco><asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset></mujoco>', /no room for this model/],
    ['<mujoco><asset><hfield name="h" nrow="1000" ncol="1000" size="1 1 1 1"/></asset></mujoco>', /nhfielddata is 1000000, and/],
    ['<mujoco><size memory="1900M"/></mujoco>', null],
    ['<mujoco><size memory="20G"/></mujoco>', null],
    [world('<replicate count="2001"><geom size="1"/></replicate>'), /ngeom is 2001, and a page shows models up to 2000/],
    [world(`${'<body>'.repeat(2000)}${'</body>'.repeat(2000)}`), /ELEMENT_DEPTH_EXCEEDED/],
    [world('<body><freejoint/><geom size="1"/></body>'), null],
  ]) {
    bench.take()
    await bench.load('a', { xml }, 'plain', 'missing')
    const [{ type, kind, message, fatal }] = bench.messages
    assert.deepEqual([type, kind, fatal], wrong ? ['error', 'load', false] : ['ready', undefined, undefined], `${xml.slice(0, 90)}: ${message}`)
    if (wrong) assert.match(message, wrong)
  }
  for (const [size, distance] of [[1.1, 7], [9, null]]) {
    bench.take()
    const camera = { azimuth: null, elevation: null, distance: 7, target: null }
    await bench.load('a', { xml: world(`<geom size="${size}"/>`), camera, extent: 2, floor: 0 }, 'plain', 'missing')
    const { scene } = bench.of('ready')[0]
    if (distance) assert.deepEqual([scene.camera.distance, scene.floor], [7, 0], 'the camera of a model as large')
    else assert.deepEqual([scene.camera.distance > 10, scene.floor], [true, null], 'the camera of this model')
  }
  bench.take()
  const xml = world('<body pos="0 0 3"><freejoint/><geom size="1.1"/></body>')
  await bench.load('a', { xml, camera: { azimuth: 90, distance: 7 }, extent: 2, floor: 5, isOther: true }, 'plain', 'missing')
  const { scene } = bench.of('ready')[0]
  assert.notEqual(scene.camera.distance, 7, 'no camera of the lab for another model, though it is as large')
  assert.ok(scene.floor < 1.9 && scene.floor > 1, 'and a floor below that model')
  bench.send({ type: 'ping' })
  assert.equal(bench.of('pong').length, 1)
})

test('an engine that cannot be had is told, and tried again for the next lab', async () => {
  const bench = new Bench({ codes: { plain } })
  const { compile: working } = bench.host.services
  bench.host.services.compile = async () => {
    throw new Error('wasm: 503')
  }
  await bench.load('a')
  assert.deepEqual(bench.of('error').map(({ message, fatal }) => [message, fatal]), [
    ['the lab does not load: wasm: 503', false],
  ])
  bench.host.services.compile = working
  await bench.load('b')
  assert.equal(bench.of('ready').length, 1)
})

test('time goes back and on, and the page is told what no longer belongs to the run', async () => {
  const bench = new Bench({ codes: { plain: code({ plots: [[({ data }) => data.time]] }) } })
  await bench.load('a', { plots: [plot(1)] })
  const last = () => {
    bench.run(20)
    return bench.of('frame').at(-1)
  }
  bench.send({ type: 'play', lab: 'a' })
  bench.run(500)
  bench.send({ type: 'seek', lab: 'a', time: 0.1 })
  assert.equal(bench.of('paused').at(-1).reason, 'user')
  const back = last()
  assert.ok(Math.abs(back.time - 0.1) < 1e-9)
  const { end } = back.tape
  assert.ok(end > 0.4)
  for (const [n, time] of [[-1, 0.098], [1, 0.1], [-1000, 0]]) {
    bench.send({ type: 'step', lab: 'a', n })
    const frame = last()
    assert.deepEqual([frame.time.toFixed(6), frame.tape.end, frame.samples.from], [time.toFixed(6), end, Infinity])
  }
  bench.send({ type: 'seek', lab: 'a', time: 0.1 })
  bench.messages.length = 0
  bench.send({ type: 'play', lab: 'a' })
  bench.run(100)
  const frames = bench.of('frame')
  assert.ok(frames.at(-1).tape.end < 0.3)
  assert.ok(frames.some(({ samples }) => Math.abs(samples.from - 0.1) < 1e-9))
  const times = frames.flatMap(({ samples }) => [...samples.times])
  assert.ok(times.every((time, i) => time > (times[i - 1] ?? 0.1)))
})

test('a model without code starts from its first keyframe, and says what it offers while it is inspected', async () => {
  const bench = new Bench()
  await bench.load('a', {}, '', 'pendulum')
  bench.run(20)
  assert.equal(bench.of('frame').at(-1).panel, null)
  bench.send({ type: 'inspect', lab: 'a', on: true })
  bench.send({ type: 'actuate', lab: 'a', index: 0, value: 0.5 })
  bench.run(40)
  assert.deepEqual(bench.of('model')[0].model.keys, ['up'])
  assert.deepEqual([...bench.of('frame').at(-1).panel.ctrl], [0.5])
  bench.send({ type: 'state', lab: 'a' })
  assert.ok([...bench.of('state')[0].state.physics].includes(3))
})
