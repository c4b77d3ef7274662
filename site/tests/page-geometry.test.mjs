/** Shapes of geoms: sizes, normals and texture coordinates as MuJoCo's renderer has them (measured from its pictures). */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { GEOM, hfieldGeometry, meshGeometry, shape } from '../js/lab/page/geometry.js'

/** Extents along z of a shape of a size, from its parts. */
function reach(type, size, model = false) {
  const ends = [Infinity, -Infinity]
  for (const { geometry, place } of shape(type, model)) {
    const out = [1, 1, 1, 0]
    place(size, out)
    const { position } = geometry.attributes
    for (let i = 0; i < position.count; i++) {
      const z = position.getZ(i) * out[2] + out[3]
      ends[0] = Math.min(ends[0], z)
      ends[1] = Math.max(ends[1], z)
    }
  }
  return ends.map((z) => Math.round(z * 1e5) / 1e5)
}

/** Texture coordinates of the vertex nearest to a point, among those whose normal points along `normal`. */
function uvAt({ geometry }, point, normal) {
  const { position, normal: normals, uv } = geometry.attributes
  let best = null
  for (let i = 0; i < position.count; i++) {
    const facing = normal.reduce((sum, x, j) => sum + x * normals.getComponent(i, j), 0)
    const distance = Math.hypot(...point.map((x, j) => x - position.getComponent(i, j)))
    if (facing > 0.9 && (best === null || distance < best.distance)) best = { distance, uv: [uv.getX(i), uv.getY(i)] }
  }
  return best.uv.map((x) => Math.round(x * 1e4) / 1e4)
}

test('sizes are those of the model or of the visualizer', () => {
  assert.deepEqual(reach(GEOM.CYLINDER, [0.1, 0.3, 0], true), [-0.3, 0.3])
  assert.deepEqual(reach(GEOM.CYLINDER, [0.1, 0.1, 0.3]), [-0.3, 0.3])
  assert.deepEqual(reach(GEOM.CAPSULE, [0.1, 0.3, 0], true), [-0.4, 0.4])
  assert.deepEqual(reach(GEOM.SPHERE, [0.2, 0, 0], true), [-0.2, 0.2])
  assert.deepEqual(reach(GEOM.ELLIPSOID, [1, 2, 0.5]), [-0.5, 0.5])
  assert.deepEqual(reach(GEOM.BOX, [1, 2, 0.5]), [-0.5, 0.5])
  assert.deepEqual(reach(GEOM.LINE, [1, 1, 2]), [0, 2])
})

test('an arrow reaches half of its third size, a double one on both sides', () => {
  assert.deepEqual(reach(GEOM.ARROW, [0.05, 0.05, 1]), [0, 0.5])
  assert.deepEqual(reach(GEOM.ARROW1, [0.05, 0.05, 1]), [0, 0.5])
  assert.deepEqual(reach(GEOM.ARROW2, [0.05, 0.05, 1]), [-0.5, 0.5])
  assert.deepEqual(reach(GEOM.ARROW, [0.05, 0.05, 0.01]), [0, 0.005])
})

test('a texture is spread over each face of a box, upright on the sides', () => {
  const [box] = shape(GEOM.BOX, true)
  assert.deepEqual(uvAt(box, [1, 1, 1], [1, 0, 0]), [1, 0])
  assert.deepEqual(uvAt(box, [-1, 1, 1], [-1, 0, 0]), [1, 0])
  assert.deepEqual(uvAt(box, [1, 1, -1], [0, 1, 0]), [1, 1])
  assert.deepEqual(uvAt(box, [-1, -1, 1], [0, -1, 0]), [0, 0])
  assert.deepEqual(uvAt(box, [1, 1, 1], [0, 0, 1]), [1, 0])
  assert.deepEqual(uvAt(box, [1, 1, -1], [0, 0, -1]), [1, 0])
})

test('a texture goes around round shapes from +x by way of +y, and from the top down', () => {
  const [ball] = shape(GEOM.SPHERE, true)
  assert.deepEqual(uvAt(ball, [0, 1, 0], [0, 1, 0]), [0.25, 0.5])
  assert.deepEqual(uvAt(ball, [-1, 0, 0], [-1, 0, 0]), [0.5, 0.5])
  assert.deepEqual(uvAt(ball, [0, -1, 0], [0, -1, 0]), [0.75, 0.5])
  assert.equal(uvAt(ball, [0, 0, 1], [0, 0, 1])[1], 0)
  const [cylinder] = shape(GEOM.CYLINDER, true)
  assert.deepEqual(uvAt(cylinder, [0, 1, 1], [0, 1, 0]), [0.25, 0])
  assert.deepEqual(uvAt(cylinder, [-1, 0, -1], [-1, 0, 0]), [0.5, 1])
  assert.deepEqual(uvAt(cylinder, [0, 1, 1], [0, 0, 1]), [0.5, 1])
  assert.deepEqual(uvAt(cylinder, [1, 0, -1], [0, 0, -1]), [1, 0.5])
  const [side, top, bottom] = shape(GEOM.CAPSULE, true)
  assert.deepEqual(uvAt(side, [0, 1, -1], [0, 1, 0]), [0.25, 1])
  assert.equal(uvAt(top, [0, 0, 1], [0, 0, 1])[1], 0)
  assert.equal(uvAt(top, [0, 1, 0], [0, 1, 0])[1], 1)
  assert.equal(uvAt(bottom, [0, 0, -1], [0, 0, -1])[1], 1)
})

const fold = (angle) => ({
  vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -Math.cos(angle), Math.sin(angle)],
  normals: [0, 0, 1],
  faces: [0, 1, 2, 0, 3, 1],
  faceNormals: [0, 0, 0, 0, 0, 0],
  texcoords: null,
  faceTexcoords: null,
})

test('the corners of a mesh are smooth where a face is turned little from its vertex normal, else sharp', () => {
  const normalOf = (mesh) => [...meshGeometry(mesh).attributes.normal.array.slice(9, 12)]
  assert.deepEqual(normalOf(fold(0.3)), [0, 0, 1])
  const sharp = normalOf(fold(1.2))
  assert.ok(Math.abs(sharp[1] - Math.sin(1.2)) < 1e-6 && Math.abs(sharp[2] - Math.cos(1.2)) < 1e-6, String(sharp))
})

test('a height field stands between its floor and its heights, and all its faces look outwards', () => {
  const geometry = hfieldGeometry({ rows: 3, columns: 4, size: [2, 1, 0.5, 0.1], data: [0, 0, 0, 0, 0, 1, 0.5, 0, 0, 0, 0, 0] })
  const { position } = geometry.attributes
  const zs = Array.from({ length: position.count }, (_, i) => position.getZ(i))
  assert.ok(Math.abs(Math.max(...zs) - 0.5) < 1e-6 && Math.abs(Math.min(...zs) + 0.1) < 1e-6)
  // The volume that the faces enclose: half-lengths 2 and 1, floor 0.1, and around the
  // heights of 0.5 and 0.25 six triangles of 2/3 each, a third of whose area times the height is under them.
  let volume = 0
  const { array } = geometry.index
  for (let i = 0; i < array.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => [0, 1, 2].map((j) => position.getComponent(array[i + k], j)))
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
  }
  assert.ok(Math.abs(volume - 1.8) < 1e-6, String(volume))
})
