/** What is drawn beyond shapes: mirrors, highlights, ropes, shadows, planes from below, small textures. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Matrix4, PerspectiveCamera, Scene, Vector3, Vector4 } from 'three'
import { planeGeometry, ropePieces } from '../js/lab/page/geometry.js'
import { Lights, ambientOf } from '../js/lab/page/lights.js'
import { Materials, finishOf } from '../js/lab/page/materials.js'
import { reflect } from '../js/lab/page/mirror.js'
import { Solid } from '../js/lab/page/solid.js'
import { Stage } from '../js/lab/page/stage.js'
import { Flex, writeTubeMatrix } from '../js/lab/page/surfaces.js'
import { World, aim } from '../js/lab/page/world.js'
import { withSmallTextures } from '../js/lab/trial/record.js'

const near = (a, b, slack = 1e-6) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < slack, `${a} is not ${b}`))

/** A camera at a point that looks at another. */
function lensAt(eye, target) {
  const forward = new Vector3(...target).sub(new Vector3(...eye))
  const axes = { forward: forward.clone().normalize() }
  axes.right = axes.forward.clone().cross(new Vector3(0, 0, 1)).normalize()
  axes.up = axes.right.clone().cross(axes.forward)
  const lens = new PerspectiveCamera()
  lens.matrixAutoUpdate = false
  const camera = {
    fovy: 45,
    distance: forward.length(),
    position: () => eye,
    axes: () => Object.fromEntries(Object.entries(axes).map(([name, axis]) => [name, axis.toArray()])),
  }
  aim(lens, camera, { extent: 1, visual: { znear: 0.01, zfar: 50 } }, 4, 3)
  return lens
}

/** Where a lens sees a point: x, y and depth in [-1, 1]. */
const seen = (lens, point) => {
  const p = new Vector4(...point, 1).applyMatrix4(lens.matrixWorldInverse).applyMatrix4(lens.projectionMatrix)
  return [p.x / p.w, p.y / p.w, p.z / p.w]
}

test('a mirrored lens sees things where their images are, with left and right exchanged', () => {
  const lens = lensAt([3, -4, 2], [0.2, 0.1, 0.3])
  const mirrored = new PerspectiveCamera()
  mirrored.matrixAutoUpdate = false
  const normal = new Vector3(0.1, -0.2, 1).normalize()
  const plane = { point: new Vector3(0, 0, 0.2), normal }
  assert.equal(reflect(lens, plane, mirrored), true)
  for (const point of [[0, 0, 1], [1, 1, 0.8], [-1, 0.5, 2]]) { // prettier-ignore
    const height = normal.dot(new Vector3(...point).sub(plane.point))
    const image = new Vector3(...point).addScaledVector(normal, -2 * height)
    const [x, y] = seen(lens, image.toArray())
    near(seen(mirrored, point).slice(0, 2), [-x, y])
  }
  assert.ok(mirrored.matrixWorld.determinant() > 0, 'front faces stay front faces')
})

test('what is behind the mirror is cut off, and nothing before it', () => {
  const lens = lensAt([3, -4, 2], [0, 0, 0])
  const mirrored = new PerspectiveCamera()
  mirrored.matrixAutoUpdate = false
  reflect(lens, { point: new Vector3(0, 0, 0.5), normal: new Vector3(0, 0, 1) }, mirrored)
  for (const [x, y] of [[0, 0], [1, -1], [-2, 1.5]]) { // prettier-ignore
    near([seen(mirrored, [x, y, 0.5])[2]], [-1], 1e-5)
    assert.ok(seen(mirrored, [x, y, 0.49])[2] < -1, 'below')
    const depth = seen(mirrored, [x, y, 0.51])[2]
    assert.ok(depth > -1 && depth < 1, 'above')
    const high = seen(mirrored, [x, y, 3])[2]
    assert.ok(high > depth && high < 1, 'higher is farther')
  }
  assert.equal(reflect(lens, { point: new Vector3(0, 0, 2.5), normal: new Vector3(0, 0, 1) }, mirrored), false, 'from behind')
})

const INFO = { emission: 0, specular: 0.5, shininess: 0.5, reflectance: 0, metallic: -1, roughness: -1, rgba: [1, 1, 1, 1], texture: -1 }

test('metallic and roughness replace specular and shininess where one of them is set', () => {
  assert.deepEqual(finishOf(undefined, 1), finishOf(INFO, 1))
  const { shininess, specular, metallic } = finishOf(INFO, 0.5)
  assert.deepEqual([shininess, metallic], [64, 0])
  near([specular], [(8 / 66) * 0.25])
  assert.deepEqual(finishOf({ ...INFO, roughness: 0.5 }, 0.5), { shininess: 30, specular: 0.04, metallic: 0 })
  assert.deepEqual(finishOf({ ...INFO, metallic: 0.75 }, 0.5), { shininess: 64, specular: 0.04, metallic: 0.75 })
  assert.deepEqual(finishOf({ ...INFO, metallic: 3, roughness: 0 }, 0.5), { shininess: 1024, specular: 0.04, metallic: 1 })
  assert.equal(finishOf({ ...INFO, roughness: 1 }, 1).shininess, 1)
})

const HEAD = { ambient: [0.1, 0.1, 0.1], diffuse: [0.4, 0.4, 0.4], specular: [0.5, 0.5, 0.5], active: true }
const LIGHT = {
  type: 0, castshadow: true, ambient: [0, 0, 0.2], diffuse: [0.7, 0.7, 0.7], specular: [0.3, 0.3, 0.3], cutoff: 45, exponent: 10,
} // prettier-ignore

/** The description of a scene. */
const described = (parts = {}) => ({
  layout: { geoms: 8, sites: 8, lights: 8, cameras: 8, flex: 8, skin: 8, trail: 8, longestTrail: 0 },
  extent: 1, center: [0, 0, 0], visual: { headlight: HEAD, znear: 0.01, zfar: 50 },
  bodies: [], geoms: [], sites: [], materials: [], textures: [], meshes: [], hfields: [], lights: [], flexes: [], skins: [],
  springs: [], pins: [], floor: null, camera: { distance: 1 },
  ...parts,
}) // prettier-ignore

test('a metal has its colour in its highlight, and paint white', () => {
  const materials = new Materials(described({ materials: [{ ...INFO, metallic: 1, roughness: 0.5 }, { ...INFO, roughness: 0.5 }, INFO] }))
  const [metal, paint, plain] = [0, 1, 2].map((id) => materials.makeMaterial(id))
  for (const material of [metal, paint, plain]) materials.paint(material, 0.8, 0.4, 0.2, 1)
  near(metal.specular.toArray(), [0.8, 0.4, 0.2])
  near(paint.specular.toArray(), [0.04, 0.04, 0.04])
  near(paint.color.toArray(), [0.8, 0.4, 0.2])
  near(metal.color.toArray(), [0.4, 0.2, 0.1])
  near(metal.emissive.toArray(), [0.14, 0.07, 0.035])
  near(plain.emissive.toArray(), [0, 0, 0])
  // All of what comes from all sides comes back from either.
  const all = 0.35
  near(metal.color.toArray().map((x, i) => all * x + metal.emissive.toArray()[i]), paint.color.toArray().map((x) => all * x)) // prettier-ignore
})

test('light from all sides is the sum of what the lights give', () => {
  near(ambientOf(described()), [0.35, 0.35, 0.35])
  near(ambientOf(described({ lights: [LIGHT, LIGHT] })), [0.1, 0.1, 0.5])
  near(ambientOf(described({ lights: [LIGHT], visual: { headlight: { ...HEAD, active: false } } })), [0, 0, 0.2])
})

test('the first lights throw shadows, as long as there are passes', () => {
  const shadows = (...infos) =>
    new Lights(described({ lights: infos.map((info) => ({ ...LIGHT, ...info })) }), new Scene()).lights.map((light) => light.castShadow)
  const everywhere = { type: 2 }
  assert.deepEqual(shadows({}, { castshadow: false }, { type: 1 }), [true, false, true])
  assert.deepEqual(shadows(everywhere, {}, everywhere, { cutoff: 120 }, {}), [true, true, false, false, true])
  assert.deepEqual(shadows(...Array(10).fill({})), [...Array(8).fill(true), false, false])
})

/** Where a matrix by columns takes a point. */
const moved = (array, at, point) => new Vector3(...point).applyMatrix4(new Matrix4().fromArray(array, at)).toArray()

test('a tube is laid from one point to another, with its radius across', () => {
  for (const [a, b] of [[[0, 0, 0], [0, 0, 2]], [[1, 2, 3], [-1, 0.5, 3]], [[0, 0, 0], [0.1, 0, -9]]]) { // prettier-ignore
    const out = new Float32Array(32)
    writeTubeMatrix(out, 16, Float32Array.from([9, 9, 9, ...a, ...b]), 3, 6, 0.25)
    near(moved(out, 16, [0, 0, -1]), a)
    near(moved(out, 16, [0, 0, 1]), b)
    const along = b.map((x, i) => x - a[i])
    const middle = moved(out, 16, [0, 0, 0])
    for (const side of [[1, 0, 0], [0, 1, 0]]) { // prettier-ignore
      const across = moved(out, 16, side).map((x, i) => x - middle[i])
      near([Math.hypot(...across)], [0.25])
      near([across.reduce((sum, x, i) => sum + x * along[i], 0)], [0], 1e-5)
    }
    assert.ok(new Matrix4().fromArray(out, 16).determinant() > 0, 'its outside stays outside')
  }
  const out = new Float32Array(16)
  writeTubeMatrix(out, 0, [1, 1, 1, 1, 1, 1], 0, 3, 0.5)
  assert.ok(out.every(Number.isFinite))
})

test('a flex of lines is tubes and balls of its radius', () => {
  const info = { dim: 1, elements: [0, 1, 1, 2], start: 1, count: 3, radius: 0.1, flat: false, group: 0, material: -1, rgba: [1, 0, 0, 1] }
  const scene = new Scene()
  const flex = new Flex(scene, new Materials(described()), info, { flex: 8 })
  const frame = new Float32Array(20)
  frame.set([0, 0, 0, 1, 0, 0, 1, 1, 0], 11)
  flex.update(frame)
  const [tubes, balls] = scene.children
  assert.deepEqual([tubes.count, balls.count], [2, 3])
  near(moved(tubes.instanceMatrix.array, 16, [0, 0, 1]), [1, 1, 0])
  near(moved(balls.instanceMatrix.array, 32, [0, 0, 1]), [1, 1, 0.1])
  assert.ok(scene.children.every((mesh) => mesh.castShadow && mesh.visible))
  flex.dispose()
  assert.equal(scene.children.length, 0)
})

test('pieces of ropes are round and face outwards', () => {
  for (const geometry of Object.values(ropePieces())) {
    const { position, normal } = geometry.attributes
    const { array } = geometry.index
    for (let i = 0; i < array.length; i += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => new Vector3().fromBufferAttribute(position, array[i + k]))
      const across = b.sub(a).cross(c.sub(a))
      assert.ok(across.dot(new Vector3().fromBufferAttribute(normal, array[i])) >= -1e-9)
    }
  }
})

test('from below a plane shows its other side, half seen through and lit as from above', () => {
  const materials = new Materials(described())
  const solid = new Solid(new Scene(), materials, { type: 0 })
  const row = new Float32Array([0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 2, 1, 0.5, 0.5, 0.5, 1])
  const look = (z) => solid.update(row, 0, 12, 15, { eye: [0, 5, z], target: [0, 0, 0] })
  const side = () => [solid.isBelow, solid.meshes[0].geometry === planeGeometry(true), solid.material.opacity, solid.material.transparent]
  look(2)
  assert.deepEqual(side(), [false, false, 1, false])
  look(0.5)
  assert.deepEqual(side(), [true, true, 0.5, true])
  look(1.5)
  assert.deepEqual(side(), [false, false, 1, false])
  const [above, below] = [false, true].map(planeGeometry)
  assert.deepEqual([...below.attributes.normal.array], [...above.attributes.normal.array])
  assert.deepEqual([...below.attributes.uv.array], [...above.attributes.uv.array])
  assert.notDeepEqual([...below.index.array], [...above.index.array])
})

test('only a plane or a box whose material reflects makes a mirror', () => {
  const materials = [INFO, { ...INFO, reflectance: 0.3 }]
  const mirror = (...geoms) => new World(described({ materials, geoms: geoms.map((geom) => ({ group: 0, body: 0, ...geom })) })).mirror
  assert.equal(mirror({ type: 0, material: 0 }, { type: 2, material: 1 }, { type: 0, material: -1 }), null)
  assert.equal(mirror({ type: 0, material: 1, group: 4 }), null)
  const both = mirror({ type: 2, material: 1 }, { type: 6, material: 1 }, { type: 0, material: 1 })
  assert.deepEqual(both.surfaces.map(({ solid, reflectance }) => [solid.type, reflectance]), [[6, 0.3], [0, 0.3]]) // prettier-ignore
})

test('what is added to a scene is seen before a face that it lies in', () => {
  const { material } = new World(described()).decoration(6, 0)
  assert.ok(material.polygonOffset && material.polygonOffsetFactor < 0 && material.polygonOffsetUnits < 0)
})

test('textures are made small by the mean of their texels', () => {
  const grey = (width, height, type, value) => ({
    name: 'a', type, width, height, channels: 1, srgb: false, data: Uint8Array.from({ length: width * height }, (_, i) => value(i % width, Math.floor(i / width))),
  }) // prettier-ignore
  const small = grey(16, 8, 0, (x) => x)
  const wide = grey(512, 100, 0, (x) => (x % 2) * 100)
  const odd = grey(300, 300, 0, (x, y) => (x < 150 === y < 150 ? 255 : 0))
  const cube = grey(128, 768, 1, (x, y) => 40 * Math.floor(y / 128))
  const { textures } = withSmallTextures({ textures: [small, wide, odd, cube] })
  assert.equal(textures[0], small)
  assert.deepEqual([textures[1].width, textures[1].height], [256, 100])
  assert.ok(textures[1].data.every((x) => x === 50))
  assert.deepEqual([textures[2].width, textures[2].height], [256, 256])
  assert.ok(textures[2].data.every((x, i) => x === ((i % 256 < 128) === Math.floor(i / 256) < 128 ? 255 : 0)))
  assert.deepEqual([textures[3].width, textures[3].height], [64, 384])
  assert.ok(textures[3].data.every((x, i) => x === 40 * Math.floor(i / 64 / 64)))
})

test('shadows are made once for each picture: for its reflection where it has one', () => {
  const stage = new Stage()
  const made = []
  stage.renderer = { shadowMap: { autoUpdate: false }, setPixelRatio() {}, setSize() {}, render: () => made.push(stage.renderer.shadowMap.autoUpdate) }
  Object.assign(stage, { software: true })
  const view = (mirrors) => ({ width: 4, height: 3, scene: {}, reflect: ({ renderer }) => (mirrors && renderer.render(), mirrors) })
  for (const mirrors of [true, true, false, true]) stage.draw(view(mirrors))
  assert.deepEqual(made, [true, false, true, false, true, true, false])
})

test('pictures that come too seldom are drawn coarser, and are counted if that does not help', () => {
  let now = 0
  globalThis.requestAnimationFrame = () => 1
  const canvas = { remove() {} }
  const sizes = []
  const stage = new Stage()
  stage.renderer = { domElement: canvas, shadowMap: {}, setPixelRatio: (ratio) => sizes.push(ratio), setSize() {}, render() {} }
  const view = { width: 4, height: 3, scene: {}, prepare: () => true, reflect: () => false, takeCanvas() {}, copyCanvas() {} }
  stage.add(view)
  stage.setMoving(view, true)
  const play = (span, pictures) => {
    for (let i = 0; i < pictures; i++) {
      stage.invalidate(view)
      stage.paint((now += span))
    }
  }
  const idle = () => stage.paint((now += 16))
  play(17, 60)
  assert.deepEqual([sizes, view.rate], [[1], Infinity])
  for (let i = 0; i < 60; i++) {
    play(16, 1)
    idle() // the next one has not come: the drawing is not what takes long
    now += 100
  }
  assert.deepEqual([sizes, view.rate], [[1], Infinity])
  play(50, 1)
  play(50, 20)
  assert.ok(sizes.length === 2 && view.rate === Infinity)
  play(50, 40)
  assert.ok(sizes.length === 3 && sizes[2] < 0.5 && sizes[2] > 0.4)
  assert.equal(view.rate, 20)
  play(20, 20)
  assert.equal(view.rate, Infinity)
  stage.setMoving(view, false)
  stage.paint(now)
  assert.equal(sizes.at(-1), 1)
})
