/** `lib` and `sim.contacts()` against native MuJoCo. */

import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import { before, test } from 'node:test'
import { generator } from '../js/lab/core/random.js'
import { FALLING, here, labOf, newEngine } from './helpers.mjs'

const native = JSON.parse(readFileSync(here('native.json'), 'utf8'))

let engine
before(async () => {
  engine = await newEngine()
})

function near(actual, expected, what, scale = 1) {
  const wanted = Array.isArray(expected) ? expected : [expected]
  const found = Array.isArray(expected) ? [...actual] : [actual]
  assert.equal(found.length, wanted.length, what)
  found.forEach((x, i) => assert.ok(Math.abs(x - wanted[i]) <= 1e-9 * scale, `${what}: ${x}, native ${wanted[i]}`))
}

test('the engine is of the version that the values are from', () => {
  assert.equal(engine.version, native.version)
})

for (const { name, xml, qpos, qvel, steps, end, energy, momentum, angmom, normal_force, contacts } of native.cases) {
  test(`energy, momenta and contact forces: ${name}`, (t) => {
    const setup = ({ data }) => {
      data.qpos.set(qpos)
      data.qvel.set(qvel)
    }
    const lab = labOf(t, engine, xml, {}, { setup })
    lab.start()
    if (steps > 0) lab.step(steps)
    const { lib, sim, data } = lab.sync()
    near(data.qpos, end.qpos, 'qpos')
    near(data.qvel, end.qvel, 'qvel')
    const found = lib.energy()
    for (const part of ['kinetic', 'potential', 'total']) near(found[part], energy[part], part, 100)
    near(lib.momentum(), momentum, 'momentum', 10)
    near(lib.angmom(), angmom, 'angmom', 10)
    for (const [geom, force] of Object.entries(normal_force)) near(lib.normalForce(geom), force, geom, 100)
    assert.equal(sim.contacts().length, contacts)
    near(
      lib.normalForce(),
      sim.contacts().reduce((sum, { force }) => sum + force[0], 0),
      'all',
      100,
    )
  })
}

test('what is computed on demand leaves the data as they were', (t) => {
  const lab = labOf(t, engine, native.cases[0].xml)
  lab.start()
  lab.data.qvel.fill(1)
  engine.mj.mj_forward(lab.model, lab.data)
  const { data, lib } = lab.env
  const look = () => [data.energy, data.subtree_linvel, data.subtree_angmom].map((array) => [...array])
  const flags = () => [data.flg_energypos, data.flg_energyvel, data.flg_subtreevel]
  const before = [look(), flags()]
  lib.energy()
  lib.momentum()
  lib.angmom()
  assert.deepEqual([look(), flags()], before)
  assert.ok(lib.energy().kinetic > 0)
  engine.mj.mj_subtreeVel(lab.model, data)
  assert.deepEqual([...lib.momentum()].map(Math.sign), [1, 1, 1].map(() => Math.sign(data.subtree_linvel[0])))
})

test('contacts are told with their geoms', (t) => {
  const lab = labOf(t, engine, native.cases[2].xml)
  lab.start()
  lab.step(500)
  const contacts = lab.sync().sim.contacts()
  assert.equal(contacts.length, 5)
  for (const { names, geoms, pos, normal, dist, force } of contacts) {
    assert.equal(names[0], 'floor')
    assert.deepEqual(geoms.length, 2)
    near(normal, [0, 0, 1], 'normal')
    assert.ok(Math.abs(pos[2]) < 1e-3 && dist < 0 && dist > -1e-3)
    assert.equal(force.length, 6)
    assert.ok(force[0] > 0)
  }
  assert.deepEqual([...new Set(contacts.map(({ names }) => names[1]))].sort(), ['ball', 'box'])
})

test('a geom without a name has none', (t) => {
  const xml = `<mujoco><worldbody><geom type="plane" size="1 1 1"/>
    <body pos="0 0 .1"><freejoint/><geom size=".1"/></body></worldbody></mujoco>`
  const lab = labOf(t, engine, xml)
  lab.start()
  lab.step(100)
  assert.deepEqual(lab.sync().sim.contacts().map(({ names }) => names), [['', '']])
})

test('names, numbers, and what is not there', (t) => {
  const lab = labOf(t, engine, native.cases[0].xml)
  lab.start()
  const { lib, data } = lab.sync()
  assert.equal(lib.bodyId('cart'), 1)
  assert.equal(lib.jointId('hinge'), 1)
  assert.deepEqual(lib.bodyPos('free'), data.xpos.slice(9, 12))
  assert.deepEqual(lib.bodyPos(3), data.xpos.slice(9, 12))
  assert.deepEqual(lib.sitePos('end'), data.site_xpos.slice(0, 3))
  assert.equal(lib.qpos('slide'), data.qpos[0])
  assert.equal(lib.qpos('hinge'), data.qpos[1])
  assert.deepEqual([...lib.qpos('float')], [1, 2, 3, 1, 0, 0, 0])
  assert.deepEqual([...lib.qpos('ball')], [1, 0, 0, 0])
  lib.qpos('ball').fill(9)
  lib.sitePos('end').fill(9)
  assert.equal(data.qpos[9], 1, 'a copy')
  for (const [what, call] of [
    ['site "none"', () => lib.sitePos('none')],
    ['body "none"', () => lib.bodyPos('none')],
    ['body "hinge"', () => lib.bodyId('hinge')],
    ['joint "cart"', () => lib.qpos('cart')],
    ['geom "none"', () => lib.normalForce('none')],
    ['body number 7', () => lib.bodyPos(7)],
    ['body number -1', () => lib.bodyPos(-1)],
    ['joint number 9', () => lib.qpos(9)],
  ]) {
    assert.throws(call, { message: `the model has no ${what}` })
  }
})

test('small helpers', (t) => {
  const lab = labOf(t, engine, FALLING)
  const { lib } = lab.env
  assert.equal(lib.norm([3, 4]), 5)
  assert.equal(lib.norm(new Float64Array([1, 2, 2])), 3)
  assert.equal(lib.norm([]), 0)
  assert.equal(lib.deg(Math.PI), 180)
  assert.ok(Math.abs(lib.rad(90) - Math.PI / 2) < 1e-15)
})

test('the generator: known values, range, evenness, and every bit of the seed counts', () => {
  for (const { seed, numbers } of native.random) {
    const draw = generator(seed)
    assert.deepEqual(numbers.map(() => draw()), numbers)
  }
  const draw = generator(42)
  const counts = new Array(10).fill(0)
  for (let i = 0; i < 100_000; i++) {
    const x = draw()
    assert.ok(x >= 0 && x < 1)
    counts[Math.floor(10 * x)] += 1
  }
  const chi2 = counts.reduce((sum, n) => sum + (n - 10_000) ** 2 / 10_000, 0)
  assert.ok(chi2 < 27.9, `chi-squared ${chi2} of 9 degrees of freedom`) // p = 0.001
  const starts = new Set([0, -0, 1, 2, 0.5, -1, 1e-300, 2 ** 52, Number.EPSILON].map((seed) => generator(seed)()))
  assert.equal(starts.size, 9)
})
