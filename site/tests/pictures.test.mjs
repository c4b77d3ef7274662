/** Scenes and frames of a model with one of everything. */

import assert from 'node:assert/strict'
import { before, test } from 'node:test'
import { OVERLAYS } from '../js/lab/core/frame.js'
import { arrayBuffers } from '../js/lab/worker/session.js'
import { EVERYTHING } from './everything.mjs'
import { FALLING, PENDULUM, labOf, newEngine } from './helpers.mjs'

let engine
before(async () => {
  engine = await newEngine()
})

const GEOM = 19
const named = (list, name) => list.findIndex((item) => item.name === name)
const close = (actual, expected, what) =>
  expected.forEach((x, i) => assert.ok(Math.abs(actual[i] - x) < 1e-6, `${what}: ${[...actual]} is not ${expected}`))

/** The decorations of a frame, as objects. */
function decorations(frame) {
  const [length, count] = frame
  return Array.from({ length: count }, (_, i) => {
    const row = frame.slice(length - 24 * (count - i), length - 24 * (count - i - 1))
    return { type: row[0], objtype: row[2], objid: row[3], size: [...row.slice(4, 7)], pos: [...row.slice(7, 10)], rgba: [...row.slice(19, 23)] }
  })
}

test('the scene says what everything is', (t) => {
  const lab = labOf(t, engine, EVERYTHING, { camera: { azimuth: null, elevation: -10, distance: null, target: [1, 2, 3] } })
  lab.start()
  const scene = structuredClone(lab.scene())
  const types = Object.fromEntries(scene.geoms.map(({ name, type }) => [name, type]))
  const { sphere, capsule, ellipsoid, cylinder, box, mesh, sdf, floor, ground } = types
  assert.deepEqual([floor, ground, sphere, capsule, ellipsoid, cylinder, box, mesh, sdf], [0, 1, 2, 3, 4, 5, 6, 7, 8])
  assert.deepEqual([scene.camera.azimuth, scene.camera.elevation, scene.camera.target], [30, -10, [1, 2, 3]])
  assert.equal(scene.camera.fovy, 50)
  assert.ok(scene.camera.distance > scene.extent)
  close(scene.visual.headlight.ambient, [0.2, 0.3, 0.4], 'headlight')

  const geom = (name) => scene.geoms[named(scene.geoms, name)]
  assert.equal(geom('cylinder').group, 3)
  assert.deepEqual(scene.bodies.slice(0, 2).map(({ movable }) => movable), [false, true])

  const tiles = scene.materials[geom('floor').material]
  assert.deepEqual([tiles.name, tiles.texuniform, tiles.texrepeat, tiles.reflectance], ['tiles', true, [3, 5], 0.25])
  assert.deepEqual(scene.textures.map(({ name, type, channels }) => [name, type, channels]), [
    ['sky', 2, 3],
    ['checker', 0, 3],
    ['faces', 1, 3],
  ])
  const checker = scene.textures[tiles.texture]
  assert.equal(checker.name, 'checker')
  assert.equal(checker.data.length, 8 * 8 * 3)
  assert.deepEqual([...new Set(Array.from({ length: 64 }, (_, i) => checker.data.slice(3 * i, 3 * i + 3).join()))].sort(), ['0,0,255', '255,0,0'])
  const shiny = scene.materials[named(scene.materials, 'shiny')]
  assert.deepEqual([shiny.specular, shiny.shininess, shiny.emission, shiny.texture], [0.75, 0.5, 0.125, -1])

  const cube = scene.meshes[geom('mesh').data]
  assert.equal(cube.name, 'cube')
  assert.deepEqual([cube.vertices.length, cube.faces.length, cube.texcoords], [24, 36, null])
  assert.ok(cube.faces.every((i) => i < 8) && cube.faceNormals.every((i) => 3 * i < cube.normals.length))
  assert.ok(cube.vertices.every((x) => Math.abs(Math.abs(x) - 0.1) < 1e-6))
  assert.equal(scene.meshes[geom('sdf').data].name, 'ball')
  assert.ok(scene.meshes[geom('sdf').data].faces.length > 60)

  const hills = scene.hfields[geom('ground').data]
  assert.deepEqual([hills.rows, hills.columns, hills.size], [3, 4, [1, 2, 0.5, 0.1]])
  close(hills.data, [0.75, 1, 0, 0.25], 'the row of the lowest y, which is written last')

  assert.deepEqual(scene.lights.map(({ castshadow }) => castshadow), [false, true])
  close(scene.lights[0].diffuse, [0.5, 0.6, 0.7], 'diffuse')
  assert.equal(scene.lights[1].cutoff, 30)
  assert.deepEqual(scene.sites.map(({ group }) => group), [4, 0, 0])

  const [cloth, jelly, rope] = ['cloth', 'jelly', 'rope'].map((name) => scene.flexes[named(scene.flexes, name)])
  assert.deepEqual([cloth.dim, cloth.count, cloth.elements.length], [2, 12, 12 * 3])
  assert.deepEqual([jelly.dim, jelly.count], [3, 27])
  assert.equal(jelly.elements.length % 3, 0)
  assert.ok(jelly.elements.length >= 3 * 48, 'the surface of a cube of eight cells')
  assert.deepEqual([rope.dim, rope.count, [...rope.elements]], [1, 4, [0, 1, 1, 2, 2, 3]])
  for (const { elements, count } of scene.flexes) assert.ok(elements.every((i) => i >= 0 && i < count))
  assert.deepEqual([scene.skins[0].count, [...scene.skins[0].faces]], [4, [0, 1, 2, 1, 3, 2]])
  assert.deepEqual([...scene.skins[0].texcoords], [0, 0, 1, 0, 0, 1, 1, 1])
})

test('a scene is made of copies that can be transferred, and are their own each time', (t) => {
  const lab = labOf(t, engine, EVERYTHING)
  lab.start()
  const memory = lab.data.qpos.buffer
  const buffers = arrayBuffers(lab.scene())
  assert.ok(buffers.length > 10 && !buffers.includes(memory))
  structuredClone(buffers, { transfer: buffers })
  assert.equal(lab.scene().meshes[0].vertices.length, 24)
})

test('a frame has the poses, sizes and colours of the moment', (t) => {
  const lab = labOf(t, engine, EVERYTHING)
  lab.start()
  lab.step(20)
  const frame = lab.frame()
  const { layout, geoms, sites, lights } = lab.scene()
  const { data } = lab.sync()
  assert.equal(frame[0], frame.length)
  assert.equal(layout.sites, layout.geoms + GEOM * geoms.length)
  assert.equal(layout.lights, layout.sites + GEOM * sites.length)
  assert.equal(layout.cameras, layout.lights + 7 * lights.length)
  assert.equal(layout.flex, layout.cameras + 13)
  geoms.forEach((_, i) => {
    const at = layout.geoms + GEOM * i
    close(frame.slice(at, at + 3), [...data.geom_xpos.slice(3 * i, 3 * i + 3)], 'position')
    close(frame.slice(at + 3, at + 12), [...data.geom_xmat.slice(9 * i, 9 * i + 9)], 'matrix')
  })
  const row = (name) => frame.slice(layout.geoms + GEOM * named(geoms, name), layout.geoms + GEOM * (named(geoms, name) + 1))
  close(row('box').slice(12, 15), [0.1, 0.2, 0.3], 'size')
  close(row('sphere').slice(15), [1, 0.5, 0.25, 1], 'a colour of its own goes before that of the material')
  close(row('capsule').slice(15), [0.1, 0.2, 0.3, 0.4], 'the colour of the material')
  close(row('ellipsoid').slice(15), [0.5, 0.5, 0.5, 1], 'the default')
  close(frame.slice(layout.sites + 12, layout.sites + 19), [0.01, 0.02, 0.03, 0, 1, 0, 0.5], 'site')
  close(frame.slice(layout.lights, layout.lights + 7), [0, 0, 5, 0, 0.6, -0.8, 1], 'light')
  assert.equal(frame[layout.cameras + 12], 33)
  close(frame.slice(layout.flex, layout.skin), [...data.flexvert_xpos], 'flex')
  assert.equal((layout.trail - layout.skin) / 6, 4)
  const skin = Array.from({ length: 4 }, (_, i) => frame.slice(layout.skin + 6 * i, layout.skin + 6 * i + 6))
  const drop = data.qpos[lab.model.jnt_qposadr[2] + 2] - 1
  assert.ok(drop < -0.001)
  skin.forEach((vertex, i) => close(vertex.slice(0, 3), [i % 2 === 0 ? 0 : 0.1, -2, (i < 2 ? 1 : 2) + drop], `skin ${i}`))
  skin.forEach((vertex) => assert.ok(Math.abs(Math.hypot(...vertex.slice(3)) - 1) < 1e-5, 'normals'))
})

test('tendons come as decorations, geoms and skins do not', (t) => {
  const lab = labOf(t, engine, EVERYTHING)
  lab.start()
  const found = decorations(lab.frame())
  assert.ok(found.length >= 1)
  const string = found.filter(({ objtype }) => objtype === engine.k.obj.TENDON)
  assert.equal(string.length, 1)
  close(string[0].pos, [0, -2, 1.5], 'its middle')
  close(string[0].rgba, [1, 1, 0, 1], 'its colour')
  assert.deepEqual(found.filter(({ objtype }) => [engine.k.obj.GEOM, engine.k.obj.SKIN, engine.k.obj.FLEX].includes(objtype)), [])
})

test('what lab code changes of the looks is in the next frame', (t) => {
  const lab = labOf(t, engine, FALLING, { controls: [{ type: 'button', label: 'b' }] }, {
    controls: [{ run: ({ model }) => (model.geom_rgba.set([0, 0, 1, 0.5]), (model.geom_size[0] = 0.3)) }],
  })
  lab.start()
  lab.press(0)
  const { geoms } = lab.scene().layout
  close(lab.frame().slice(geoms + 12, geoms + 19), [0.3, 0, 0, 0, 0, 1, 0.5], 'size and colour')
})

test('every overlay shows something and can be switched off', (t) => {
  const xml = `<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
    <body pos="0 0 .099"><joint type="slide" axis="0 0 1"/><geom type="box" size=".1 .1 .1"/></body></worldbody></mujoco>`
  const arrows = { width: 0.01, momentum: 1, angularMomentum: 1, axis: 1 }
  const lab = labOf(t, engine, xml, { overlays: ['com'], arrows })
  lab.start()
  lab.step(100)
  assert.equal(decorations(lab.frame()).length, 1, 'com is on')
  lab.pictures.setOverlay('com', false)
  const counts = OVERLAYS.map((name) => {
    lab.pictures.setOverlay(name, true)
    const count = decorations(lab.frame()).length
    lab.pictures.setOverlay(name, false)
    assert.equal(decorations(lab.frame()).length, 0)
    return [name, count]
  })
  assert.deepEqual(Object.fromEntries(counts), {
    frames: 3, contacts: 4, forces: 4, com: 1, inertia: 1, joints: 1, momentum: 1, angularMomentum: 0, axis: 0,
  }) // prettier-ignore
  assert.throws(() => lab.pictures.setOverlay('heat', true), { message: 'there is no overlay "heat"' })
})

test('arrows are momentum, and angular momentum about a pivot or the centre of mass', (t) => {
  const xml = `<mujoco><option gravity="0 0 0"/><worldbody>
    <body name="free" pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .3" mass="2"/></body>
    <body name="swung" pos="5 0 0"><joint axis="0 1 0"/><geom size=".01" pos="0 0 -2" mass="3"/></body></worldbody></mujoco>`
  const arrows = { width: 0.01, momentum: 0.1, angularMomentum: 1, axis: 1 }
  const lab = labOf(t, engine, xml, { overlays: ['momentum', 'angularMomentum', 'axis'], arrows })
  lab.start()
  lab.data.qvel.set([1, 0, 0, 0, 0, 4, 0.5])
  lab.settle()
  const rows = decorations(lab.frame())
  const reach = (row) => row.size[2] / 2
  assert.deepEqual(rows.map(({ type }) => type), [100, 100, 100, 100, 100, 100, 5, 5])
  close(rows[0].pos, [0, 0, 1])
  close(rows.map(reach), [0.2, 0.3, (2 / 3) * 0.05 * 4], 'lengths')
  close(rows[1].pos, [5, 0, -2])
  close(rows[4].pos, [5, 0, 0], 'the hinge')
  assert.ok(Math.abs(reach(rows[4]) - 3 * 4 * 0.5) < 1e-3)
})

test('forceScale is the length of an arrow for each newton', (t) => {
  const length = (forceScale) => {
    const lab = labOf(
      t,
      engine,
      `<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .1"><freejoint/><geom size=".1" mass="1"/></body></worldbody></mujoco>`,
      { overlays: ['forces'], forceScale },
    )
    lab.start()
    lab.step(1000)
    const [arrow] = decorations(lab.frame())
    return arrow.size[2]
  }
  assert.ok(Math.abs(length(0.02) / length(0.01) - 2) < 1e-6)
})

test('a buffer is used again when it is large enough', (t) => {
  const lab = labOf(t, engine, FALLING)
  lab.start()
  const first = lab.frame()
  assert.equal(lab.frame(first.buffer).buffer, first.buffer)
  lab.pictures.setOverlay('com', true)
  assert.equal(lab.frame(first.buffer).buffer, first.buffer, 'there is room for a few decorations')
  const small = new ArrayBuffer(8)
  assert.notEqual(lab.frame(small).buffer, small)
  assert.deepEqual([...lab.frame(null)], [...lab.frame(undefined)])
})

test('a trail keeps its last points in order', (t) => {
  const xml = PENDULUM.replace('</body>', '<site name="tip" pos="0 0 -.4"/></body>')
  const lab = labOf(t, engine, xml, { key: 'up', trail: 'tip' })
  lab.start()
  lab.step(80)
  const points = (frame) => Array.from({ length: frame[2] }, (_, i) => [...frame.slice(lab.scene().layout.trail + 3 * i).slice(0, 3)])
  const few = points(lab.frame())
  assert.equal(few.length, 11) // every 8 steps of 2 ms, and the start
  close(few[0], [0.4 * Math.sin(3) * -1, 0, 0.4 * -Math.cos(3)], 'where it started')
  close(few[10], [...lab.sync().data.site_xpos], 'where it is')
  lab.step(8 * 2500)
  const many = points(lab.frame())
  assert.equal(many.length, 2000)
  close(many[1999], [...lab.sync().data.site_xpos], 'where it is')
  const steps = many.slice(1).map((p, i) => Math.hypot(...p.map((x, j) => x - many[i][j])))
  assert.ok(Math.max(...steps) < 0.1, 'it does not jump')
  lab.reset()
  assert.equal(points(lab.frame()).length, 1)
  assert.throws(() => labOf(t, engine, xml, { trail: 'nowhere' }), { message: 'the model has no site "nowhere"' })
})

test('more decorations than there is room for are left out', (t) => {
  const bodies = Array.from({ length: 1000 }, (_, i) => `<body pos="${i} 0 0"><geom size=".1"/></body>`).join('')
  const lab = labOf(t, engine, `<mujoco><worldbody>${bodies}</worldbody></mujoco>`, { overlays: ['frames', 'inertia'] })
  lab.start()
  const frame = lab.frame()
  assert.equal(frame[0], frame.length)
  assert.ok(frame[1] <= 2000)
})
