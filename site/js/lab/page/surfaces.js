/** What bends: skins, flexes and the trail of a site, whose points come with every frame. */

import {
  BufferAttribute, BufferGeometry, DynamicDrawUsage, Line, LineBasicMaterial, LineSegments, Mesh, Sphere, Vector3,
} from 'three' // prettier-ignore

const EVERYWHERE = new Sphere(new Vector3(), Infinity)
const SHOWN_GROUPS = 3

const dynamic = (array, width) => new BufferAttribute(array, width).setUsage(DynamicDrawUsage)

/** A skin: points and normals of its vertices are in the frame. */
export class Skin {
  constructor(parent, materials, info, layout) {
    this.at = layout.skin + 6 * info.start
    this.count = info.count
    this.rgba = info.rgba
    this.geometry = new BufferGeometry()
    this.position = dynamic(new Float32Array(3 * info.count), 3)
    this.normal = dynamic(new Float32Array(3 * info.count), 3)
    this.geometry.setAttribute('position', this.position).setAttribute('normal', this.normal)
    if (info.texcoords !== null) this.geometry.setAttribute('uv', new BufferAttribute(Float32Array.from(info.texcoords), 2))
    this.geometry.setIndex(Array.from(info.faces))
    this.geometry.boundingSphere = EVERYWHERE
    const material = materials.make(info.material, { doubleSided: true })
    if (info.texcoords !== null) materials.dress(material, info.material, true)
    materials.paint(material, ...colourOf(info, materials))
    this.mesh = new Mesh(this.geometry, material)
    this.mesh.visible = info.group < SHOWN_GROUPS
    this.mesh.castShadow = this.mesh.receiveShadow = true
    parent.add(this.mesh)
  }

  update(frame) {
    for (let i = 0, from = this.at; i < this.count; i++, from += 6) {
      this.position.array.set(frame.subarray(from, from + 3), 3 * i)
      this.normal.array.set(frame.subarray(from + 3, from + 6), 3 * i)
    }
    this.position.needsUpdate = this.normal.needsUpdate = true
  }

  dispose() {
    this.mesh.removeFromParent()
    this.geometry.dispose()
  }
}

/** A flex: lines, or a surface whose normals follow from its points. */
export class Flex {
  constructor(parent, materials, info, layout) {
    this.at = layout.flex + 3 * info.start
    this.count = info.count
    this.geometry = new BufferGeometry()
    this.position = dynamic(new Float32Array(3 * info.count), 3)
    this.geometry.setAttribute('position', this.position)
    this.geometry.setIndex(Array.from(info.elements))
    this.geometry.boundingSphere = EVERYWHERE
    const colour = colourOf(info, materials)
    this.flatLines = info.dim === 1
    if (this.flatLines) {
      this.lineMaterial = new LineBasicMaterial()
      this.lineMaterial.color.setRGB(...colour.slice(0, 3))
      this.mesh = new LineSegments(this.geometry, this.lineMaterial)
    } else {
      const material = materials.make(info.material, { doubleSided: true })
      material.flatShading = info.flat
      materials.paint(material, ...colour)
      this.mesh = new Mesh(this.geometry, material)
    }
    this.mesh.visible = info.group < SHOWN_GROUPS
    this.mesh.castShadow = this.mesh.receiveShadow = true
    parent.add(this.mesh)
  }

  update(frame) {
    this.position.array.set(frame.subarray(this.at, this.at + 3 * this.count))
    this.position.needsUpdate = true
    if (!this.flatLines) this.geometry.computeVertexNormals()
  }

  dispose() {
    this.mesh.removeFromParent()
    this.geometry.dispose()
    this.lineMaterial?.dispose()
  }
}

/** The path of a site. */
export class Trail {
  constructor(parent, layout) {
    this.at = layout.trail
    this.geometry = new BufferGeometry()
    this.position = dynamic(new Float32Array(3 * layout.longestTrail), 3)
    this.geometry.setAttribute('position', this.position)
    this.geometry.boundingSphere = EVERYWHERE
    this.material = new LineBasicMaterial()
    this.line = new Line(this.geometry, this.material)
    parent.add(this.line)
  }

  /** @param {[number, number, number]} rgb in [0, 1] */
  paint(rgb) {
    this.material.color.setRGB(...rgb)
  }

  update(frame, count) {
    this.position.array.set(frame.subarray(this.at, this.at + 3 * count))
    this.position.needsUpdate = true
    this.geometry.setDrawRange(0, count)
  }

  dispose() {
    this.line.removeFromParent()
    this.geometry.dispose()
    this.material.dispose()
  }
}

/** A colour left at MuJoCo's default is that of the material. */
function colourOf({ rgba, material }, { scene }) {
  const unset = rgba.every((x, i) => x === [0.5, 0.5, 0.5, 1][i])
  return unset && material >= 0 ? scene.materials[material].rgba : rgba
}
