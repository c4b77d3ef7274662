/**
 * Marks that the model itself does not have: coils for springs, pins for hinges, the path of a site. The scene lists the springs and
 * pins (`core/scene.js`); their places come from the frames.
 */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Line, LineBasicMaterial, Mesh, Sphere, Vector3 } from 'three'
import { cylinder } from './geometry.js'
import { Ropes, writeTubeMatrix } from './surfaces.js'

const EVERYWHERE = new Sphere(new Vector3(), Infinity)
const TURNS = 9
const ROUND = 14 // pieces of a turn
const STRAIGHT = 0.08 // of a spring's length, at each end
const WIRE = 0.16 // of a coil's radius
const STEEL = [0.56, 0.58, 0.62, 1]
const IRON = [0.4, 0.41, 0.44, 1]
const PIN = 0.011 // radius of a pin, for a camera at a distance of 1
const ROW = 19 // floats of a geom in a frame

/** A spring between the centres of two geoms. */
export class Coil {
  constructor(parent, materials, { from, to, radius }, layout) {
    this.ends = [from, to].map((geom) => layout.geoms + ROW * geom)
    this.radius = radius
    const count = TURNS * ROUND + 1
    const elements = Array.from({ length: 2 * (count - 1) }, (_, i) => (i + 1) >> 1)
    const material = materials.makeMaterial(-1)
    materials.paint(material, ...STEEL)
    this.ropes = new Ropes(material, { count, elements, radius: WIRE * radius })
    this.points = new Float32Array(3 * count)
    for (const mesh of this.ropes.meshes) {
      mesh.frustumCulled = false
      parent.add(mesh)
    }
  }

  update(frame) {
    const [a, b] = this.ends.map((offset) => frame.subarray(offset, offset + 3))
    // The matrix of a tube from one end to the other holds the axes of the coil.
    const tube = new Float32Array(16)
    writeTubeMatrix(tube, 0, [...a, ...b], 0, 3, this.radius)
    const last = this.points.length / 3 - 1
    for (let i = 0; i <= last; i++) {
      const t = i / last
      const wide = Math.min(1, Math.max(0, (Math.min(t, 1 - t) - STRAIGHT) / STRAIGHT))
      const [x, y] = [Math.cos, Math.sin].map((f) => wide * f(2 * Math.PI * TURNS * t))
      for (let j = 0; j < 3; j++) this.points[3 * i + j] = a[j] + t * (b[j] - a[j]) + x * tube[j] + y * tube[4 + j]
    }
    this.ropes.update(this.points)
  }

  dispose() {
    for (const mesh of this.ropes.meshes) mesh.removeFromParent()
    this.ropes.dispose()
  }
}

/** The pin of a hinge that is fixed to the world. */
export class Pin {
  constructor(parent, materials, { position, axis }, distance) {
    const material = materials.makeMaterial(-1)
    materials.paint(material, ...IRON)
    this.mesh = new Mesh(cylinder(), material)
    this.mesh.matrixAutoUpdate = false
    const half = axis.map((x) => 2.2 * PIN * distance * x)
    const ends = [...position.map((x, i) => x - half[i]), ...position.map((x, i) => x + half[i])]
    const matrix = new Float32Array(16)
    writeTubeMatrix(matrix, 0, ends, 0, 3, PIN * distance)
    this.mesh.matrix.fromArray(matrix)
    parent.add(this.mesh)
  }

  dispose() {
    this.mesh.removeFromParent()
  }
}

/** The path of a site, which fades with its age. */
export class Trail {
  constructor(parent, layout) {
    this.offset = layout.trail
    this.geometry = new BufferGeometry()
    const dynamic = (width) => new BufferAttribute(new Float32Array(width * layout.longestTrail), width).setUsage(DynamicDrawUsage)
    this.position = dynamic(3)
    this.colour = dynamic(4)
    this.geometry.setAttribute('position', this.position).setAttribute('color', this.colour)
    this.geometry.boundingSphere = EVERYWHERE
    this.material = new LineBasicMaterial({ vertexColors: true, transparent: true })
    this.line = new Line(this.geometry, this.material)
    parent.add(this.line)
    this.count = 0
  }

  /** @param {string} colour of CSS */
  paint(colour) {
    this.material.color.setStyle(colour)
  }

  update(frame, count) {
    this.position.array.set(frame.subarray(this.offset, this.offset + 3 * count))
    this.position.needsUpdate = true
    this.geometry.setDrawRange(0, count)
    if (count === this.count) return
    this.count = count
    for (let i = 0; i < count; i++) this.colour.array.set([1, 1, 1, 0.1 + (0.9 * (i + 1)) / count], 4 * i)
    this.colour.needsUpdate = true
  }

  dispose() {
    this.line.removeFromParent()
    this.geometry.dispose()
    this.material.dispose()
  }
}
