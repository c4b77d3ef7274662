/** Models that are finer than a page can draw: which of their meshes and textures are made coarser, and how. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { limitDetail } from '../js/lab/core/detail.js'
import { Lab } from '../js/lab/core/lab.js'
import { code, config, newEngine } from './helpers.mjs'

const MODEL = `<mujoco><asset>
  <mesh name="fine" builtin="sphere" params="4"/><mesh name="plain" builtin="sphere" params="1"/><mesh name="unused" builtin="sphere" params="4"/>
  <texture name="large" type="2d" builtin="checker" width="300" height="200" rgb1="1 1 1" rgb2="0 0 0"/>
  <texture name="small" type="2d" builtin="flat" width="10" height="10"/>
</asset><worldbody>
  <geom type="mesh" mesh="fine"/><geom type="mesh" mesh="fine" pos="3 0 0"/><geom type="mesh" mesh="plain" pos="6 0 0"/>
  <geom type="mesh" mesh="unused" group="3" pos="9 0 0"/>
</worldbody></mujoco>`

test('only what is larger than its share is drawn coarser, and named', async () => {
  const engine = await newEngine()
  const lab = new Lab(engine, MODEL, config(), code())
  const scene = lab.scene()
  const limited = (...limits) => limitDetail(scene, engine.k.geom, ...limits)
  const whole = limited()
  assert.deepEqual(whole.coarse, [])
  assert.ok(whole.meshes.every((mesh, i) => mesh === scene.meshes[i]))
  const faces = ({ meshes }) => meshes.map((mesh) => mesh.faces.length / 3)
  const [fine, plain, unused] = faces(scene)
  const most = plain + 2 * 500
  assert.ok(fine > 2000 && plain < 500)
  const { meshes, textures, coarse } = limited(most, 30_000)
  assert.deepEqual(coarse, ['fine', 'large'])
  const [left, ...others] = faces({ meshes })
  assert.deepEqual(others, [plain, unused])
  assert.ok(left <= 500 && left > 250, `${left} triangles are left`)
  const { vertices, normals } = meshes[0]
  const radius = Math.hypot(...scene.meshes[0].vertices.slice(0, 3))
  for (let i = 0; i < vertices.length; i += 3) {
    const [length, one] = [vertices, normals].map((array) => Math.hypot(...array.subarray(i, i + 3)))
    assert.ok(Math.abs(length / radius - 1) < 0.1 && Math.abs(one - 1) < 1e-6, 'it is still a sphere')
    const cosine = [0, 1, 2].reduce((sum, j) => sum + vertices[i + j] * normals[i + j], 0) / length
    assert.ok(cosine > 0.9, 'and its normals point outwards')
  }
  const [large, small] = textures
  assert.ok(large.data.length <= 30_000 && large.data.length === large.width * large.height * large.channels)
  assert.ok(Math.abs(large.width / large.height - 1.5) < 0.05)
  assert.equal(small, scene.textures[1])
  lab.dispose()
})
