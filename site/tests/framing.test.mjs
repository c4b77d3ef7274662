/** The camera of a motion: all of it is seen, and no nearer camera of the same direction would see all. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { Framing, cameraAxes } from '../js/lab/core/framing.js'
import { Motion, played } from '../js/lab/trial/motion.js'
import { Lab } from '../js/lab/core/lab.js'
import { code, compile, config, newEngine } from './helpers.mjs'

const DIRECTION = { azimuth: 70, elevation: -25, fovy: 45 }
const GEOMS = `
  <geom type="sphere" size=".1"/><geom type="capsule" size=".05" fromto="0 0 0 .3 .1 .4"/>
  <geom type="box" size=".1 .2 .3" pos=".2 .5 0" euler="20 40 60"/><geom type="cylinder" size=".1" fromto="0 0 0 0 -.3 .3"/>
  <geom type="ellipsoid" size=".1 .05 .3" pos="-.4 0 0"/>`
const model = (around, body = GEOMS, option = '') => `<mujoco>${option}<worldbody>${around}
  <body pos="0 0 1"><freejoint/>${body}</body></worldbody></mujoco>`

let engine
before(async () => {
  engine = await newEngine()
})

/** The framing of half a second, and where its camera sees the points: to the right and up, 1 at the edges. */
function framed(xml, direction = DIRECTION) {
  const lab = new Lab(engine, compile(engine, xml), config(), code({}))
  lab.start()
  const framing = new Framing(lab, direction)
  framing.begin()
  const points = []
  for (let i = 0; i < 10; i++) {
    framing.observe(lab)
    points.push(...cloud(lab))
    lab.step(25)
  }
  lab.dispose()
  const camera = framing.fit()
  const { right, up, forward } = cameraAxes(direction)
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0)
  const half = Math.tan((direction.fovy * Math.PI) / 360)
  const seen = points.map((p) => {
    const d = p.map((x, i) => x - camera.target[i] + camera.distance * forward[i])
    const depth = dot(d, forward)
    return [dot(d, right) / (1.6 * half * depth), dot(d, up) / (half * depth), depth]
  })
  return { framing, camera, seen }
}

/** Points of the surfaces of boxes and balls around everything that moves. */
function* cloud({ model: m, data }) {
  for (let i = 0; i < m.ngeom; i++) {
    if (m.geom_bodyid[i] === 0) continue
    const at = data.geom_xpos.subarray(3 * i, 3 * i + 3)
    if (m.geom_type[i] === engine.k.geom.SPHERE) {
      const r = m.geom_size[3 * i]
      for (let k = 0; k < 400; k++) {
        const [z, a] = [(k + 0.5) / 200 - 1, 2.4 * k]
        const s = Math.sqrt(1 - z * z)
        yield [at[0] + r * s * Math.cos(a), at[1] + r * s * Math.sin(a), at[2] + r * z]
      }
    } else yield Array.from(at)
  }
}

test('all that moves is seen, and touches an edge of the margin', () => {
  const ball = '<geom type="sphere" size=".2"/>'
  const { seen } = framed(model('', ball))
  assert.ok(seen.every(([, , depth]) => depth > 0))
  const most = Math.max(...seen.flatMap(([x, y]) => [Math.abs(x), Math.abs(y)]))
  assert.ok(Math.abs(most - 0.9) < 0.01, `${most}`)
  for (const [x, y] of framed(model('')).seen) assert.ok(Math.max(Math.abs(x), Math.abs(y)) < 0.9)
})

test('what stands still close by is seen, and what lies far off draws the camera nowhere', () => {
  const wide = framed(model('', GEOMS, '<option gravity="0 0 0"/>')).camera.distance
  const close = framed(model('<geom type="box" size=".05 .05 .05" pos="0 0 1.6"/>', GEOMS, '<option gravity="0 0 0"/>')).camera.distance
  const far = framed(model('<geom type="box" size=".05 .05 .05" pos="0 0 9"/>', GEOMS, '<option gravity="0 0 0"/>')).camera.distance
  assert.ok(close > wide)
  assert.equal(far, wide)
})

test('the floor is the plane of the model, or under everything, and there is none where nothing falls', () => {
  const plane = '<geom type="plane" size="1 1 1" pos="0 0 -.5"/>'
  assert.equal(framed(model(plane)).framing.floor(), -0.5)
  assert.equal(framed(model(plane.replace('/>', ' euler="0 20 0"/>'))).framing.floor(), null)
  const { framing } = framed(model(''))
  assert.ok(framing.floor() < -0.3 && framing.floor() > -0.6, `${framing.floor()}`)
  assert.equal(framed(model('', GEOMS, '<option gravity="0 0 0"/>')).framing.floor(), null)
})

test('what fills the picture is told for any camera', () => {
  const { framing, camera } = framed(model('', '<geom type="sphere" size=".2"/>', '<option gravity="0 0 0"/>'))
  const part = framing.fill(camera)
  assert.ok(part > 0.4 && part < 0.81 / 1.6, `${part}`)
  assert.ok(Math.abs(framing.fill({ ...camera, distance: 3 * camera.distance }) / part - 1 / 9) < 0.01)
  assert.equal(framing.fill({ ...camera, target: [50, 0, 0] }), 0)
})

test('a model in which nothing moves has no camera of its own', () => {
  const lab = new Lab(engine, compile(engine, '<mujoco><worldbody><geom size="1"/></worldbody></mujoco>'), config(), code({}))
  lab.start()
  const framing = new Framing(lab, DIRECTION)
  framing.begin()
  framing.observe(lab)
  lab.dispose()
  assert.equal(framing.fit(), null)
  assert.equal(framing.floor(), null)
})

test('a run in which something flies off is left out', () => {
  const lab = new Lab(engine, compile(engine, model('', GEOMS, '<option gravity="0 0 0"/>')), config(), code({}))
  lab.start()
  const framing = new Framing(lab, DIRECTION)
  const run = (z) => {
    framing.begin()
    lab.data.qpos[2] = z
    lab.dirty = true
    framing.observe(lab)
    return framing.fit().distance
  }
  const [first, near, far] = [run(1), run(1.2), run(90)]
  lab.dispose()
  assert.ok(near > first)
  assert.equal(far, near)
})

test('the camera does not follow what falls out of the scene', () => {
  const pass = 'contype="0" conaffinity="0"'
  const scene = (around) => `<mujoco><worldbody>${around}
    <body name="ball" pos="0 0 1"><freejoint/><geom size=".1" ${pass}/></body></worldbody></mujoco>`
  const arm = `<body pos="0 0 2"><joint axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 .5 0 0" ${pass}/></body>`
  const run = (xml, steps) => {
    const lab = new Lab(engine, compile(engine, xml), config(), code({}))
    lab.start()
    const framing = new Framing(lab, DIRECTION)
    framing.begin()
    for (let i = 0; i < 20; i++) {
      framing.observe(lab)
      lab.step(steps)
    }
    lab.dispose()
    return framing
  }
  const plane = `<geom type="plane" size="1 1 .1" ${pass}/>`
  for (const around of [plane, plane + arm, `<geom type="box" size="1 1 .1" ${pass}/>${arm}`]) {
    const framing = run(scene(around), 100)
    assert.equal(framing.fallen.size, 1, around)
    assert.ok(Math.min(...framing.fallen.values()) < -50, around)
    assert.ok(framing.fit().distance < 12, `${around} ${framing.fit().distance}`)
  }
  for (const around of ['', '<geom size=".1" pos="0 0 1.5"/>']) assert.ok(run(scene(around), 100).fit().distance > 50, 'there is nothing else to see')
  assert.equal(run(scene('<geom type="plane" size="1 1 .1"/>').replaceAll(pass, ''), 100).fallen.size, 0, 'it lies on the floor')
})

test('what is seen to move counts, and only in the first three seconds', () => {
  const share = (geom, { qvel = [], seconds = 1, gravity = '0 0 0' } = {}) => {
    const xml = `<mujoco><option gravity="${gravity}"/><worldbody><body pos="0 0 1"><freejoint/>${geom}</body></worldbody></mujoco>`
    const lab = new Lab(engine, compile(engine, xml), config(), code({}))
    lab.start()
    lab.data.qvel.set(qvel)
    const motion = new Motion(lab)
    for (const end = lab.time + seconds; lab.time < end; lab.step(20)) motion.observe(lab)
    lab.dispose()
    return motion.share({ ...DIRECTION, distance: 4, target: [0, 0, 1] })
  }
  const [ball, rod] = ['<geom size=".1"/>', '<geom type="box" size=".5 .02 .02"/>']
  assert.equal(share(ball), 0)
  assert.equal(share(ball, { qvel: [0, 0, 0, 3, 0, 0] }), 0, 'a ball looks the same however it turns')
  assert.equal(share(ball, { qvel: [0, 0, 1e-4, 0, 0, 0] }), 0, 'that is too little')
  assert.ok(share(rod, { qvel: [0, 0, 0, 0, 0, 3] }) > 0.01)
  const fall = share(ball, { gravity: '0 0 -1', seconds: 1 })
  assert.ok(fall > 0.005 && fall < 0.1, `${fall}`)
  const late = share(ball, { gravity: '0 0 -0.0001', seconds: 3 })
  assert.equal(late, 0)
})

test('what an exercise begins with is seen, also if its first step goes far', () => {
  const falling = model('', '<geom size=".1"/>', '<option timestep="9"/>')
  const { begin } = played(() => new Lab(engine, compile(engine, falling), config(), code({})))
  assert.ok(begin.scene.camera.distance < 1)
})
