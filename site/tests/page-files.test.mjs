/** Models of the reader's own: what is found in files and zips, and that no file, however it is made, does more than fail. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { deflateRawSync } from 'node:zlib'
import { FilesError, readModels } from '../js/lab/page/files.js'
import { Lab } from '../js/lab/core/lab.js'
import { code, config, newEngine } from './helpers.mjs'

const utf8 = (text) => new TextEncoder().encode(text)
const file = (name, content) => new File([content], name)
const model = (body = '') => `<mujoco>${body}<worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>`

/** A zip of files: `[name, content, changes of the entry]`. */
function zip(entries) {
  const parts = []
  const directory = []
  let at = 0
  for (const [name, content, { method = 8, flags = 0, size = null, start = null } = {}] of entries) {
    const data = typeof content === 'string' ? utf8(content) : content
    const packed = method === 8 ? deflateRawSync(data) : data
    const head = Buffer.alloc(30)
    head.writeUInt32LE(0x04034b50, 0)
    head.writeUInt16LE(utf8(name).length, 26)
    const entry = Buffer.alloc(46)
    entry.writeUInt32LE(0x02014b50, 0)
    entry.writeUInt16LE(flags, 8)
    entry.writeUInt16LE(method, 10)
    entry.writeUInt32LE(size ?? packed.length, 20)
    entry.writeUInt16LE(utf8(name).length, 28)
    entry.writeUInt32LE(start ?? at, 42)
    directory.push(entry, utf8(name))
    parts.push(head, utf8(name), packed)
    at += 30 + utf8(name).length + packed.length
  }
  const end = Buffer.alloc(22)
  end.writeUInt32LE(0x06054b50, 0)
  end.writeUInt16LE(entries.length, 10)
  end.writeUInt32LE(at, 16)
  return Buffer.concat([...parts, ...directory, end])
}

const open = (...entries) => readModels([file('robot.zip', zip(entries))])
const paths = async (...entries) => [...(await open(...entries)).models.keys()]
const refused = (promise, key) => assert.rejects(promise, (error) => error instanceof FilesError && error.key === key)

test('a zip is unpacked, and the scene in it is the model', async () => {
  const { models, files } = await open(
    ['robot/', ''],
    ['robot/robot.xml', model()],
    ['robot/scene.xml', '<mujoco><include file="robot.xml"/></mujoco>'],
    ['robot/assets/hand.obj', 'v 0 0 0', { method: 0 }],
    ['robot/README.xml', '<notes/>'],
  )
  assert.deepEqual([...models], [['robot/scene.xml', '<mujoco><include file="robot.xml"/></mujoco>']])
  assert.deepEqual([...files.keys()].sort(), ['robot/README.xml', 'robot/assets/hand.obj', 'robot/robot.xml', 'robot/scene.xml'])
  assert.equal(new TextDecoder().decode(files.get('robot/assets/hand.obj')), 'v 0 0 0')
})

test('the models of a zip are those that no other includes, the likeliest first', async () => {
  const including = (path) => `<mujoco><include file="${path}"/></mujoco>`
  assert.deepEqual(await paths(['a/b/c.xml', model()], ['part.xml', model()], ['whole.xml', including('part.xml')]), ['whole.xml', 'a/b/c.xml'])
  const order = await paths(['arm.xml', model()], ['arm_fixed.xml', model()], ['on_a_floor.xml', including('arm.xml')])
  assert.deepEqual(order, ['on_a_floor.xml', 'arm_fixed.xml'], 'first that which includes another')
  const robots = await paths(['a/scene.xml', including('arm.xml')], ['a/arm.xml', including('./parts/hand.xml')], ['a/parts/hand.xml', model()], ['b/arm.xml', model()])
  assert.deepEqual(robots, ['a/scene.xml', 'b/arm.xml'], 'another model of the same name')
  assert.deepEqual(await paths(['a/x/scene.xml', including('../arm.xml')], ['a/arm.xml', model()]), ['a/x/scene.xml'])
  assert.deepEqual([...(await readModels([file('robot.urdf', '<robot name="r"/>')])).models.keys()], ['robot.urdf'])
})

test('files that lie elsewhere are left out, and what is no model is told', async () => {
  const { files } = await open(['m.xml', model()], ['../../etc/passwd', 'x'], ['/absolute.obj', 'v'], ['C:\\windows.obj', 'v'])
  assert.deepEqual([...files.keys()], ['m.xml', 'absolute.obj'])
  await refused(open(['notes.xml', '<notes/>'], ['mesh.obj', 'v']), 'file_none')
  await refused(readModels([]), 'file_none')
  await refused(readModels([file('m.xml', model(' '.repeat(100_001)))]), 'file_large')
})

test('a zip that unfolds to too much is stopped, whatever it claims', async () => {
  await refused(open(['m.xml', model()], ['zeros.stl', new Uint8Array(70 << 20)]), 'file_large')
  await refused(open(...Array.from({ length: 2001 }, (_, i) => [`${i}.obj`, 'v'])), 'file_large')
  const part = new Uint8Array(9 << 20)
  await refused(open(...Array.from({ length: 8 }, (_, i) => [`${i}.stl`, part])), 'file_large')
})

test('zips that are encrypted, cut off or garbled are refused, and nothing else happens', async () => {
  await refused(open(['m.xml', model(), { flags: 1 }]), 'file_zip')
  await refused(open(['m.xml', model(), { method: 12 }]), 'file_zip')
  await refused(open(['m.xml', model(), { size: 1e9 }]), 'file_zip')
  await refused(open(['m.xml', model(), { start: 4e9 }]), 'file_zip')
  const whole = zip([['m.xml', model()], ['a/b.obj', 'v 1 2 3']])
  let seed = 7
  const draw = (n) => (seed = (seed * 48271) % 2147483647) % n
  for (let i = 0; i < 300; i++) {
    const bytes = Uint8Array.from(whole.subarray(0, i % 3 === 0 ? draw(whole.length) : whole.length))
    for (let k = 0; k < 1 + draw(4) && bytes.length > 4; k++) bytes[4 + draw(bytes.length - 4)] = draw(256)
    await readModels([file('m.zip', bytes)]).catch((error) => assert.ok(error instanceof FilesError, String(error.stack)))
  }
})

test('the engine finds the files beside a model, those that it includes too, and keeps none', async () => {
  const engine = await newEngine()
  const corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map((point) => `v ${point.join(' ')}`)
  const { models, files } = await open(
    ['r/scene.xml', '<mujoco><compiler meshdir="assets"/><include file="parts/body.xml"/></mujoco>'],
    ['r/parts/body.xml', '<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'],
    ['r/assets/m.obj', [...corners, 'f 1 3 2', 'f 1 2 4', 'f 1 4 3', 'f 2 3 4'].join('\n')],
  )
  const [[main, text]] = models
  for (let i = 0; i < 2; i++) {
    const lab = new Lab(engine, text, config(), code(), {}, { main, files })
    assert.equal(lab.model.nmeshvert, 4)
    lab.start()
    lab.step(10)
    lab.dispose()
  }
  assert.throws(() => new Lab(engine, text, config(), code(), {}, { main, files: new Map() }), /Error opening file|body\.xml/)
  assert.throws(() => new Lab(engine, text, config(), code()), /body\.xml/)
})
