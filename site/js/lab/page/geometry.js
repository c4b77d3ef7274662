/**
 * The shapes of MuJoCo's geoms as three.js geometries.
 *
 * A shape is a list of parts. Each part has a geometry of unit size, shared by all labs, and a function that scales it and shifts it
 * along its z axis for a geom's size. So a size may change from frame to frame without a new geometry.
 *
 * Texture coordinates are those of MuJoCo's renderer, for a texture that is spread over the shape once: over each face of a box, around
 * and from top to bottom of round shapes, with the first row of the texture on top. `direction` is the attribute by which a cube
 * texture is looked up.
 */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  ConeGeometry,
  CylinderGeometry,
  EdgesGeometry,
  PlaneGeometry,
  SphereGeometry,
} from 'three'
import { cross } from '../core/vectors.js'

/** mjtGeom */
export const GEOM = Object.freeze({
  PLANE: 0, HFIELD: 1, SPHERE: 2, CAPSULE: 3, ELLIPSOID: 4, CYLINDER: 5, BOX: 6, MESH: 7, SDF: 8,
  ARROW: 100, ARROW1: 101, ARROW2: 102, LINE: 103, LINEBOX: 104,
}) // prettier-ignore

const ROUND = 40 // segments around
const QUARTER = 10 // segments from a pole to the equator
const ROPE = 12 // segments around a piece of a rope; fewer, as there are many pieces
const HEAD_WIDTH = 1.75 // of an arrow, in widths of its shaft
const HEAD_LENGTH = 3 // in radii of its shaft

const cache = new Map()

/**
 * A geometry of unit size, made once. `wrap(x, y, z, nx, ny, nz)` returns texture coordinates that replace those of three.js, or
 * null; `lift` moves the directions along z.
 */
function unit(name, make, wrap = null, lift = 0) {
  if (!cache.has(name)) cache.set(name, textured(make(), wrap, lift))
  return cache.get(name)
}

function textured(geometry, wrap, lift) {
  const { position, normal, uv } = geometry.attributes
  if (uv === undefined) return geometry // lines
  const direction = new Float32Array(3 * position.count)
  for (let i = 0; i < position.count; i++) {
    const point = [position.getX(i), position.getY(i), position.getZ(i)]
    direction.set([point[0], point[1], point[2] + lift], 3 * i)
    const coordinates = wrap === null ? null : wrap(...point, normal.getX(i), normal.getY(i), normal.getZ(i))
    if (coordinates === null) uv.setY(i, 1 - uv.getY(i))
    else uv.setXY(i, ...coordinates)
  }
  geometry.setAttribute('direction', new BufferAttribute(direction, 3))
  return geometry
}

// three.js has its axes along y; textures of its spheres begin half a turn, those of its cylinders a quarter from MuJoCo's.
const standing = (geometry, turn) => geometry.rotateX(Math.PI / 2).rotateZ(turn)
const sphere = (start, angle, rings) => standing(new SphereGeometry(1, ROUND, rings, 0, 2 * Math.PI, start, angle), Math.PI)
const barrel = (open) => standing(new CylinderGeometry(1, 1, 2, ROUND, 1, open), Math.PI / 2)

const onFace = (x, y, z, nx, ny, nz) => [(1 + (Math.abs(nx) > 0.5 ? y : x)) / 2, (1 - (Math.abs(nz) > 0.5 ? y : z)) / 2]
const onLid = (x, y, z, nx, ny, nz) => (Math.abs(nz) > 0.9 ? [(1 + x) / 2, (1 + y) / 2] : null)
const fromAbove = (x, y) => [(1 + x) / 2, (1 - y) / 2]

const box = () => unit('box', () => new BoxGeometry(2, 2, 2), onFace)
const ball = () => unit('ball', () => sphere(0, Math.PI, 2 * QUARTER))
export const cylinder = () => unit('cylinder', () => barrel(false), onLid)
const tube = () => unit('tube', () => barrel(true))
const dome = () => unit('dome', () => sphere(0, Math.PI / 2, QUARTER), null, 1)
const bowl = () => unit('bowl', () => sphere(Math.PI / 2, Math.PI / 2, QUARTER), null, -1)
const plane = () => unit('plane', () => new PlaneGeometry(2, 2), fromAbove)
const planeFromBelow = () => unit('plane from below', () => inverted(new PlaneGeometry(2, 2)), fromAbove)
const cone = () => unit('cone', () => standing(new ConeGeometry(1, 1, ROUND), 0).translate(0, 0, 0.5))
const edges = () => unit('edges', () => new EdgesGeometry(new BoxGeometry(2, 2, 2)))
const line = () =>
  unit('line', () => new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array([0, 0, 0, 0, 0, 1]), 3)))

/** Flip the faces of a surface so that it is seen from its other side, with the same normals. */
function inverted(geometry) {
  const { array } = geometry.index
  for (let i = 0; i < array.length; i += 3) [array[i], array[i + 1]] = [array[i + 1], array[i]]
  return geometry
}

/** A plane's geometry for an eye above or below it. */
export const planeGeometry = (isBelow) => (isBelow ? planeFromBelow() : plane())

/** Pieces of a rope, of length 2 along z or radius 1. */
export const ropePieces = () => ({
  tube: unit('rope', () => standing(new CylinderGeometry(1, 1, 2, ROPE, 1, true), 0)),
  knot: unit('knot', () => standing(new SphereGeometry(1, ROPE, ROPE / 2), 0)),
})

/** A part: its geometry, and how `place(size, out)` fills out = [scale x, y, z, shift along z]. */
const part = (geometry, place, lines = false) => ({ geometry, place, lines })
const set = (out, x, y, z, shift = 0) => {
  out[0] = x
  out[1] = y
  out[2] = z
  out[3] = shift
}

const scaledParts = (geometry) => [part(geometry, (s, out) => set(out, s[0], s[1], s[2]))]

/** The parts of a shape with radius and half-length; the length is `size[lengthIndex]`: third in the visualizer, second in the model. */
const roundParts = (pieces, lengthIndex) => pieces.map(([geometry, kind]) =>
  part(geometry, (s, out) => {
    const r = s[0]
    const half = s[lengthIndex]
    if (kind === 'side') set(out, r, r, half)
    else set(out, r, r, r, kind === 'top' ? half : -half)
  }),
) // prettier-ignore

/** An arrow is half as long as its third size; a double one reaches so far to both sides. */
const arrow = (width, isDouble) => {
  const reach = (s) => s[2] / 2
  const head = (s) => Math.min(HEAD_LENGTH * s[0], reach(s) / 2)
  const shaft = part(cylinder(), (s, out) => {
    const length = reach(s) - head(s)
    set(out, s[0], s[1], isDouble ? length : length / 2, isDouble ? 0 : length / 2)
  })
  const tip = (sign) =>
    part(cone(), (s, out) => set(out, width * s[0], sign * width * s[1], sign * head(s), sign * (reach(s) - head(s))))
  return isDouble ? [shaft, tip(1), tip(-1)] : [shaft, tip(1)]
}

/**
 * The parts of a shape.
 *
 * @param {number} type mjtGeom
 * @param {boolean} model whether sizes are the model's (radius, half-length) or the visualizer's (radius, radius, half-length)
 * @param {import('three').BufferGeometry | null} [geometry] of a mesh or height field
 */
export function shape(type, model, geometry = null) {
  const half = model ? 1 : 2
  switch (type) {
    case GEOM.SPHERE:
      return [part(ball(), (s, out) => set(out, s[0], s[0], s[0]))]
    case GEOM.ELLIPSOID:
      return scaledParts(ball())
    case GEOM.BOX:
      return scaledParts(box())
    case GEOM.CYLINDER:
      return roundParts([[cylinder(), 'side']], half)
    case GEOM.CAPSULE:
      return roundParts([[tube(), 'side'], [dome(), 'top'], [bowl(), 'bottom']], half) // prettier-ignore
    case GEOM.PLANE:
      return [part(plane(), (s, out) => set(out, s[0], s[1], 1))]
    case GEOM.MESH:
    case GEOM.SDF:
    case GEOM.HFIELD:
      return geometry === null ? [] : [part(geometry, (_, out) => set(out, 1, 1, 1))]
    case GEOM.ARROW:
      return arrow(HEAD_WIDTH, false)
    case GEOM.ARROW1:
      return arrow(1, false)
    case GEOM.ARROW2:
      return arrow(HEAD_WIDTH, true)
    case GEOM.LINE:
      return [part(line(), (s, out) => set(out, 1, 1, s[2]), true)]
    case GEOM.LINEBOX:
      return [part(edges(), (s, out) => set(out, s[0], s[1], s[2]), true)]
    default:
      return []
  }
}

/**
 * A mesh of the model. Each corner has its own texture coordinate, as in the file, and its own normal: that of the vertex, or that of
 * the face if the two differ much, as in MuJoCo's renderer.
 */
export function meshGeometry(mesh) {
  const { vertices, normals, faces, faceNormals, texcoords, faceTexcoords } = mesh
  const count = faces.length
  const position = new Float32Array(3 * count)
  const normal = new Float32Array(3 * count)
  const uv = new Float32Array(2 * count)
  for (let i = 0; i < count; i++) {
    const v = 3 * faces[i]
    const n = 3 * faceNormals[i]
    for (let j = 0; j < 3; j++) {
      position[3 * i + j] = vertices[v + j]
      normal[3 * i + j] = normals[n + j]
    }
    if (i % 3 === 2) sharpen(position, normal, 3 * (i - 2))
    const source = texcoords === null ? vertices : texcoords
    const t = texcoords === null ? v : 2 * faceTexcoords[i]
    uv[2 * i] = source[t]
    uv[2 * i + 1] = source[t + 1]
  }
  const places = new BufferAttribute(position, 3)
  return new BufferGeometry()
    .setAttribute('position', places)
    .setAttribute('direction', places)
    .setAttribute('normal', new BufferAttribute(normal, 3))
    .setAttribute('uv', new BufferAttribute(uv, 2))
}

const SMOOTH = 0.8 // cosine of the largest angle between the normals of vertex and face

function sharpen(position, normal, offset) {
  const side = (k) => [0, 1, 2].map((j) => position[offset + 3 * k + j] - position[offset + j])
  const [a, b] = [side(1), side(2)]
  const face = cross(a, b)
  const length = Math.hypot(...face)
  if (length === 0) return
  for (let corner = offset; corner < offset + 9; corner += 3) {
    const cosine = face.reduce((sum, x, j) => sum + x * normal[corner + j], 0) / length
    if (cosine < SMOOTH) for (let j = 0; j < 3; j++) normal[corner + j] = face[j] / length
  }
}

/** A height field: its surface, its four sides and its floor. */
export function hfieldGeometry({ rows, columns, size, data }) {
  const [halfX, halfY, top, base] = size
  const position = []
  const uv = []
  const index = []
  const vertex = (column, row, z) => {
    const u = (2 * column) / (columns - 1) - 1
    const v = (2 * row) / (rows - 1) - 1
    uv.push((1 + u) / 2, (1 - v) / 2)
    return position.push(halfX * u, halfY * v, z) / 3 - 1
  }
  const height = (column, row) => top * data[row * columns + column]
  const quad = (a, b, c, d) => index.push(a, b, c, a, c, d)
  for (let row = 0; row < rows; row++) for (let column = 0; column < columns; column++) vertex(column, row, height(column, row))
  for (let row = 0; row + 1 < rows; row++) {
    for (let column = 0; column + 1 < columns; column++) {
      const a = row * columns + column
      quad(a, a + 1, a + columns + 1, a + columns)
    }
  }
  // The sides have vertices of their own, so that the edge is sharp.
  const wall = (points) => {
    const pairs = points.map(([column, row]) => [vertex(column, row, height(column, row)), vertex(column, row, -base)])
    for (let i = 0; i + 1 < pairs.length; i++) quad(pairs[i][1], pairs[i + 1][1], pairs[i + 1][0], pairs[i][0])
  }
  const list = (n, make) => Array.from({ length: n }, (_, i) => make(i))
  wall(list(columns, (i) => [i, 0]))
  wall(list(rows, (i) => [columns - 1, i]))
  wall(list(columns, (i) => [columns - 1 - i, rows - 1]))
  wall(list(rows, (i) => [0, rows - 1 - i]))
  quad(vertex(0, 0, -base), vertex(0, rows - 1, -base), vertex(columns - 1, rows - 1, -base), vertex(columns - 1, 0, -base))
  const geometry = new BufferGeometry()
    .setAttribute('position', new BufferAttribute(new Float32Array(position), 3))
    .setAttribute('uv', new BufferAttribute(new Float32Array(uv), 2))
  geometry.setAttribute('direction', geometry.attributes.position)
  geometry.setIndex(index)
  geometry.computeVertexNormals()
  return geometry
}
