/** A geom in the picture: its parts, material and texture, placed anew for every frame. */

import { LineBasicMaterial, LineSegments, Mesh } from 'three'
import { GEOM, planeGeometry, shape } from './geometry.js'

const FAR = 40 // half-size of an endless plane, in extents of the model
const FROM_BELOW = 0.5 // opacity of a plane seen from below, as in MuJoCo

export class Solid {
  /**
   * @param {import('three').Object3D} parent
   * @param {import('./materials.js').Materials} materials
   * @param {Record<string, any>} info `type` (mjtGeom), `material` (id or -1), `geometry` of a mesh or height field, `model` (see `shape`)
   */
  constructor(parent, materials, { type, material = -1, geometry = null, model = true, wrapped = false, extent = 1 }) {
    this.materials = materials
    this.type = type
    this.model = model
    this.plane = type === GEOM.PLANE
    this.isBelow = false
    this.isVisible = true
    this.far = FAR * extent
    this.parts = shape(type, model, geometry)
    this.material = materials.makeMaterial(material)
    this.fit = this.parts.length > 0 ? materials.applyTexture(this.material, material, wrapped) : null
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
    this.placement = [1, 1, 1, 0]
  }

  lineMaterial() {
    this.lines ??= new LineBasicMaterial()
    return this.lines
  }

  /**
   * Set place, size and colour from a frame.
   *
   * @param {Float32Array} f @param {number} offset where position (3) and matrix (9, by rows) begin
   * @param {number} size where the size (3) begins @param {number} colour where the colour (4) begins
   * @param {{eye: number[], target: number[]}} sight the places of the camera and of its target, which is the centre of an endless plane
   */
  update(f, offset, size, colour, sight, emission = this.material.userData.emission) {
    let alpha = f[colour + 3]
    this.show(alpha > 0)
    if (alpha <= 0) return
    if (this.plane && this.faceEye(f, offset, sight.eye)) alpha *= FROM_BELOW
    this.materials.paint(this.material, f[colour], f[colour + 1], f[colour + 2], alpha, emission)
    if (this.lines !== null) this.lines.color.setRGB(f[colour], f[colour + 1], f[colour + 2])
    if (this.plane && (f[size] <= 0 || f[size + 1] <= 0)) this.placeEndless(f, offset, size, sight.target)
    else {
      this.resize(f[size], f[size + 1], f[size + 2])
      this.place(f, offset, f[offset], f[offset + 1], f[offset + 2])
    }
  }

  /** Show the side of a plane that faces the eye, lit like its upper side, as in MuJoCo; returns whether it is the lower one. */
  faceEye(f, offset, eye) {
    const height = f[offset + 5] * (eye[0] - f[offset]) + f[offset + 8] * (eye[1] - f[offset + 1]) + f[offset + 11] * (eye[2] - f[offset + 2])
    if (height < 0 !== this.isBelow) {
      this.isBelow = height < 0
      this.meshes[0].geometry = planeGeometry(this.isBelow)
    }
    return this.isBelow
  }

  resize(a, b, c) {
    const { size } = this
    if (size[0] === a && size[1] === b && size[2] === c) return
    size[0] = a
    size[1] = b
    size[2] = c
    this.fit?.(this.visualSize(size))
  }

  /** The size in the visualizer's form. */
  visualSize(size) {
    if (!this.model) return size
    if (this.type === GEOM.SPHERE) return [size[0], size[0], size[0]]
    return this.type === GEOM.CAPSULE || this.type === GEOM.CYLINDER ? [size[0], size[0], size[1]] : size
  }

  place(f, offset, x, y, z) {
    const { placement } = this
    for (let i = 0; i < this.parts.length; i++) {
      this.parts[i].place(this.size, placement)
      const [sx, sy, sz, shift] = placement
      const mesh = this.meshes[i]
      mesh.matrix.set(
        sx * f[offset + 3], sy * f[offset + 4], sz * f[offset + 5], x + shift * f[offset + 5],
        sx * f[offset + 6], sy * f[offset + 7], sz * f[offset + 8], y + shift * f[offset + 8],
        sx * f[offset + 9], sy * f[offset + 10], sz * f[offset + 11], z + shift * f[offset + 11],
        0, 0, 0, 1,
      ) // prettier-ignore
      mesh.matrixWorldNeedsUpdate = true
    }
  }

  /** Move a plane without a size to where the camera looks; its texture stays fixed to the world. */
  placeEndless(f, offset, size, target) {
    const d = [target[0] - f[offset], target[1] - f[offset + 1], target[2] - f[offset + 2]]
    const component = (j) => f[offset + 3 + j] * d[0] + f[offset + 6 + j] * d[1] + f[offset + 9 + j] * d[2]
    const u = f[size] > 0 ? 0 : component(0)
    const v = f[size + 1] > 0 ? 0 : component(1)
    const centre = [0, 1, 2].map((i) => f[offset + i] + u * f[offset + 3 + 3 * i] + v * f[offset + 4 + 3 * i])
    this.size[0] = f[size] > 0 ? f[size] : this.far
    this.size[1] = f[size + 1] > 0 ? f[size + 1] : this.far
    this.fit?.(this.size, u, v, true)
    this.place(f, offset, ...centre)
  }

  show(visible) {
    this.isVisible = visible
    for (const mesh of this.meshes) mesh.visible = visible
  }

  remove() {
    for (const mesh of this.meshes) mesh.removeFromParent()
    this.lines?.dispose()
  }
}
