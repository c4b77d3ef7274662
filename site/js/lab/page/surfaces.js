/** Deformable surfaces: skins and flexes, whose points come with every frame. */

import {
  BufferAttribute, BufferGeometry, DynamicDrawUsage, InstancedMesh, Mesh, Sphere, Vector3,
} from 'three' // prettier-ignore
import { cross } from '../core/vectors.js'
import { ropePieces } from './geometry.js'

const EVERYWHERE = new Sphere(new Vector3(), Infinity)
const SHOWN_GROUPS = 3

const dynamic = (array, width) => new BufferAttribute(array, width).setUsage(DynamicDrawUsage)

class Cloth {
  constructor(material, { count, elements }) {
    this.geometry = new BufferGeometry()
    this.position = dynamic(new Float32Array(3 * count), 3)
    this.geometry.setAttribute('position', this.position)
    this.geometry.setIndex(Array.from(elements))
    this.geometry.boundingSphere = EVERYWHERE
    this.meshes = [new Mesh(this.geometry, material)]
  }

  update(points) {
    this.position.array.set(points)
    this.position.needsUpdate = true
    this.geometry.computeVertexNormals()
  }

  dispose() {
    this.geometry.dispose()
  }
}

/** A skin: points and normals of its vertices are in the frame. */
export class Skin extends Cloth {
  constructor(parent, materials, info, layout) {
    const material = materials.makeMaterial(info.material, { doubleSided: true })
    super(material, { count: info.count, elements: info.faces })
    this.offset = layout.skin + 6 * info.start
    this.count = info.count
    this.normal = dynamic(new Float32Array(3 * info.count), 3)
    this.geometry.setAttribute('normal', this.normal)
    if (info.texcoords !== null) {
      this.geometry.setAttribute('uv', new BufferAttribute(Float32Array.from(info.texcoords), 2))
      materials.applyTexture(material, info.material, true)
    }
    addSurface(parent, this, material, materials, info)
  }

  update(frame) {
    for (let i = 0, offset = this.offset; i < this.count; i++, offset += 6) {
      this.position.array.set(frame.subarray(offset, offset + 3), 3 * i)
      this.normal.array.set(frame.subarray(offset + 3, offset + 6), 3 * i)
    }
    this.position.needsUpdate = this.normal.needsUpdate = true
  }

  dispose() {
    this.meshes[0].removeFromParent()
    super.dispose()
  }
}

/** A flex: a surface whose normals follow from its points, or the ropes of one of dimension 1. */
export class Flex {
  constructor(parent, materials, info, layout) {
    this.offset = layout.flex + 3 * info.start
    this.count = info.count
    const material = materials.makeMaterial(info.material, { doubleSided: info.dim > 1 })
    material.flatShading = info.dim > 1 && info.flat
    this.part = info.dim === 1 ? new Ropes(material, info) : new Cloth(material, info)
    addSurface(parent, this.part, material, materials, info)
  }

  update(frame) {
    this.part.update(frame.subarray(this.offset, this.offset + 3 * this.count))
  }

  dispose() {
    for (const mesh of this.part.meshes) mesh.removeFromParent()
    this.part.dispose()
  }
}

/** Lines with the radius of the flex and round ends: a tube for each element, a ball for each vertex. */
export class Ropes {
  constructor(material, { count, elements, radius }) {
    const { tube, knot } = ropePieces()
    this.elements = elements
    this.radius = radius
    this.tubes = new InstancedMesh(tube, material, elements.length / 2)
    this.knots = new InstancedMesh(knot, material, count)
    this.meshes = [this.tubes, this.knots]
    for (const { instanceMatrix } of this.meshes) instanceMatrix.setUsage(DynamicDrawUsage)
  }

  update(points) {
    const { elements, radius } = this
    const tubes = this.tubes.instanceMatrix
    for (let i = 0; 2 * i < elements.length; i++) writeTubeMatrix(tubes.array, 16 * i, points, 3 * elements[2 * i], 3 * elements[2 * i + 1], radius)
    const knots = this.knots.instanceMatrix
    for (let i = 0, offset = 0; i < knots.count; i++, offset += 3) {
      knots.array.set([radius, 0, 0, 0, 0, radius, 0, 0, 0, 0, radius, 0, points[offset], points[offset + 1], points[offset + 2], 1], 16 * i)
    }
    tubes.needsUpdate = knots.needsUpdate = true
  }

  dispose() {
    for (const mesh of this.meshes) mesh.dispose()
  }
}

/**
 * Write the matrix that lays a tube (along z, from -1 to 1, of radius 1) from one point to another.
 *
 * @param {Float32Array} out by columns @param {number} offset where it begins there @param {number} a @param {number} b where the points begin
 */
export function writeTubeMatrix(out, offset, points, a, b, radius) {
  const half = [0, 1, 2].map((i) => (points[b + i] - points[a + i]) / 2)
  const length = Math.hypot(...half)
  const z = length > 0 ? half.map((x) => x / length) : [0, 0, 1]
  // Any axis that is not along the tube will do.
  const s = Math.abs(z[2]) < 0.9 ? [-z[1], z[0], 0] : [0, -z[2], z[1]]
  const n = radius / Math.hypot(...s)
  const x = s.map((value) => n * value)
  const y = cross(z, x)
  out.set([...x, 0, ...y, 0, ...half, 0, ...[0, 1, 2].map((i) => (points[a + i] + points[b + i]) / 2), 1], offset)
}

/** Paint a surface, and put its meshes into the picture. */
function addSurface(parent, { meshes }, material, materials, info) {
  materials.paint(material, ...colourOf(info, materials))
  for (const mesh of meshes) {
    mesh.visible = info.group < SHOWN_GROUPS
    mesh.castShadow = mesh.receiveShadow = true
    mesh.frustumCulled = false
    parent.add(mesh)
  }
}

/** The colour of a skin or flex; one left at MuJoCo's default is that of the material. */
function colourOf({ rgba, material }, { scene }) {
  const unset = rgba.every((x, i) => x === [0.5, 0.5, 0.5, 1][i])
  return unset && material >= 0 ? scene.materials[material].rgba : rgba
}
