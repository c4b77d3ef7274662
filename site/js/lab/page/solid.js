/** One geom in the picture: its parts, material and texture, placed anew for every frame. */

import { LineBasicMaterial, LineSegments, Mesh } from 'three'
import { GEOM, planeSeen, shape } from './geometry.js'

const FAR = 40 // an endless plane reaches so many extents of the model
const FROM_BELOW = 0.5 // MuJoCo shows what is above a plane through it: so much of it is left

export class Solid {
  /**
   * @param {import('three').Object3D} parent
   * @param {import('./materials.js').Materials} materials
   * @param {object} info `type` (mjtGeom), `material` (id or -1), `geometry` of a mesh or height field, `model` (see `shape`)
   */
  constructor(parent, materials, { type, material = -1, geometry = null, model = true, wrapped = false, extent = 1 }) {
    Object.assign(this, { materials, type, model })
    this.plane = type === GEOM.PLANE
    this.below = false
    this.shown = true
    this.far = FAR * extent
    this.parts = shape(type, model, geometry)
    this.material = materials.make(material)
    this.fit = this.parts.length > 0 ? materials.dress(this.material, material, wrapped) : null
    this.lines = null
    this.meshes = this.parts.map((part) => {
      const mesh = part.lines ? new LineSegments(part.geometry, this.lineMaterial()) : new Mesh(part.geometry, this.material)
      mesh.matrixAutoUpdate = false
      mesh.frustumCulled = !this.plane
      mesh.castShadow = !part.lines && !this.plane
      mesh.receiveShadow = !part.lines
      parent.add(mesh)
      return mesh
    })
    this.size = [NaN, NaN, NaN]
    this.placed = [1, 1, 1, 0]
  }

  lineMaterial() {
    this.lines ??= new LineBasicMaterial()
    return this.lines
  }

  /**
   * Take place, size and colour from a frame.
   *
   * @param {Float32Array} f @param {number} at where position (3) and matrix (9, by rows) begin
   * @param {number} size where the size (3) begins @param {number} colour where the colour (4) begins
   * @param {{eye: number[], target: number[]}} sight where the camera is and what it looks at, which is the middle of an endless plane
   */
  update(f, at, size, colour, sight, emission = this.material.userData.emission) {
    let alpha = f[colour + 3]
    this.show(alpha > 0)
    if (alpha <= 0) return
    if (this.plane && this.turn(f, at, sight.eye)) alpha *= FROM_BELOW
    this.materials.paint(this.material, f[colour], f[colour + 1], f[colour + 2], alpha, emission)
    if (this.lines !== null) this.lines.color.setRGB(f[colour], f[colour + 1], f[colour + 2])
    if (this.plane && (f[size] <= 0 || f[size + 1] <= 0)) this.unroll(f, at, size, sight.target)
    else {
      this.resize(f[size], f[size + 1], f[size + 2])
      this.place(f, at, f[at], f[at + 1], f[at + 2])
    }
  }

  /** Show that side of a plane on which the eye is, lit as its upper side is, as MuJoCo's are; gives whether it is the lower one. */
  turn(f, at, eye) {
    const height = f[at + 5] * (eye[0] - f[at]) + f[at + 8] * (eye[1] - f[at + 1]) + f[at + 11] * (eye[2] - f[at + 2])
    if (height < 0 !== this.below) {
      this.below = height < 0
      this.meshes[0].geometry = planeSeen(this.below)
    }
    return this.below
  }

  resize(a, b, c) {
    const { size } = this
    if (size[0] === a && size[1] === b && size[2] === c) return
    size[0] = a
    size[1] = b
    size[2] = c
    this.fit?.(this.visible(size))
  }

  /** The size as the visualizer has it. */
  visible(size) {
    if (!this.model) return size
    if (this.type === GEOM.SPHERE) return [size[0], size[0], size[0]]
    return this.type === GEOM.CAPSULE || this.type === GEOM.CYLINDER ? [size[0], size[0], size[1]] : size
  }

  place(f, at, x, y, z) {
    const { placed } = this
    for (let i = 0; i < this.parts.length; i++) {
      this.parts[i].place(this.size, placed)
      const [sx, sy, sz, shift] = placed
      const mesh = this.meshes[i]
      mesh.matrix.set(
        sx * f[at + 3], sy * f[at + 4], sz * f[at + 5], x + shift * f[at + 5],
        sx * f[at + 6], sy * f[at + 7], sz * f[at + 8], y + shift * f[at + 8],
        sx * f[at + 9], sy * f[at + 10], sz * f[at + 11], z + shift * f[at + 11],
        0, 0, 0, 1,
      ) // prettier-ignore
      mesh.matrixWorldNeedsUpdate = true
    }
  }

  /** A plane without a size goes where the camera looks; its texture stays where it is in the world. */
  unroll(f, at, size, target) {
    const d = [target[0] - f[at], target[1] - f[at + 1], target[2] - f[at + 2]]
    const along = (j) => f[at + 3 + j] * d[0] + f[at + 6 + j] * d[1] + f[at + 9 + j] * d[2]
    const u = f[size] > 0 ? 0 : along(0)
    const v = f[size + 1] > 0 ? 0 : along(1)
    const shifted = [0, 1, 2].map((i) => f[at + i] + u * f[at + 3 + 3 * i] + v * f[at + 4 + 3 * i])
    this.size[0] = f[size] > 0 ? f[size] : this.far
    this.size[1] = f[size + 1] > 0 ? f[size + 1] : this.far
    this.fit?.(this.size, u, v, true)
    this.place(f, at, ...shifted)
  }

  show(visible) {
    this.shown = visible
    for (const mesh of this.meshes) mesh.visible = visible
  }

  remove() {
    for (const mesh of this.meshes) mesh.removeFromParent()
    this.lines?.dispose()
  }
}
