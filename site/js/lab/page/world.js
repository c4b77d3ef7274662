/**
 * A lab's picture as a three.js scene: made once from the description of the model (`core/scene.js`), moved by every frame
 * (`core/frame.js`).
 */

import { CubeTexture, Matrix4, Raycaster, Scene, Vector2 } from 'three'
import { GEOM, hfieldGeometry, meshGeometry } from './geometry.js'
import { Lights } from './lights.js'
import { Coil, Pin, Trail } from './marks.js'
import { Materials } from './materials.js'
import { Mirror } from './mirror.js'
import { Solid } from './solid.js'
import { Edges, Floor, canOutline } from './studio.js'
import { Flex, Skin } from './surfaces.js'

const SHOWN_GROUPS = 3 // groups 0, 1 and 2, as in MuJoCo's viewer
export const ROW = 19 // floats of a geom or site in a frame
const SIZE = 12
const COLOUR = 15
const DECORATION = 24
const IN_FRONT = -2 // see `arrows.js` of the core
const PALE = 0.35 // opacity of a ghost
const USUAL = 1.6 // width of a view over its height

export class World {
  /** @param {any} description the `scene` of the worker's message `ready` */
  constructor(description) {
    this.description = description
    this.scene = new Scene()
    this.materials = new Materials(description)
    this.lights = new Lights(description, this.scene)
    this.shapes = new Map() // geometries of meshes and height fields
    // A floor with a grid takes the place of a plane without a colour of its own.
    this.ground = description.lights.length > 0 ? null : description.floor
    const isShown = ({ group, level }) => group < SHOWN_GROUPS && (level === null || level !== this.ground)
    this.geoms = description.geoms.map((geom) => (isShown(geom) ? this.solid(geom) : null))
    this.sites = description.sites.map((site) => (site.group < SHOWN_GROUPS ? this.solid(site) : null))
    this.skins = description.skins.map((skin) => new Skin(this.scene, this.materials, skin, description.layout))
    this.flexes = description.flexes.map((flex) => new Flex(this.scene, this.materials, flex, description.layout))
    this.coils = description.springs.map((spring) => new Coil(this.scene, this.materials, spring, description.layout))
    this.pins = description.pins.map((pin) => new Pin(this.scene, this.materials, pin, description.camera.distance))
    this.trail = description.layout.longestTrail > 0 ? new Trail(this.scene, description.layout) : null
    this.decorations = new Map()
    this.ghosts = [] // pale geoms of bodies that move, once a kept run is shown
    this.edges = new Edges()
    this.floor = this.makeFloor()
    this.mirror = this.makeMirror()
    this.setSky()
    this.raycaster = new Raycaster()
  }

  /** Outline all bodies, unless they have very many triangles; returns the floor of a model that has none and no lights, or null. */
  makeFloor() {
    const solids = this.geoms.filter((solid) => solid !== null && !solid.plane)
    const bodies = solids.flatMap(({ meshes }) => meshes)
    if (canOutline(bodies)) for (const { meshes, material } of solids) for (const mesh of meshes) this.edges.add(mesh, material)
    return this.ground === null ? null : new Floor(this.scene, this.ground, this.description.camera.distance, bodies)
  }

  setSky() {
    const sky = this.materials.sky()
    if (!(sky instanceof CubeTexture)) return
    this.scene.background = sky
    // MuJoCo's faces are about its z axis, three.js's about y.
    this.scene.backgroundRotation.set(Math.PI / 2, 0, 0)
  }

  solid({ type, material, data = -1 }) {
    const geometry = this.geometry(type, data)
    const wrapped = geometry !== null && this.description.meshes[data]?.texcoords != null && type !== GEOM.HFIELD
    return new Solid(this.scene, this.materials, { type, material, geometry, wrapped, extent: this.description.extent })
  }

  /** The mirror, or null if nothing in the model reflects. */
  makeMirror() {
    const { geoms, materials } = this.description
    const surfaces = geoms.flatMap(({ type, material }, i) => {
      const reflectance = materials[material]?.reflectance ?? 0
      const flat = type === GEOM.PLANE || type === GEOM.BOX
      return flat && reflectance > 0 && this.geoms[i] !== null ? [{ solid: this.geoms[i], reflectance }] : []
    })
    return surfaces.length > 0 ? new Mirror(surfaces) : null
  }

  /** The geometry of a mesh or a height field, made once; null for any other shape. */
  geometry(type, id) {
    const isField = type === GEOM.HFIELD
    if (!isField && type !== GEOM.MESH && type !== GEOM.SDF) return null
    const info = this.description[isField ? 'hfields' : 'meshes'][id]
    if (info === undefined) return null
    if (!this.shapes.has(info)) this.shapes.set(info, isField ? hfieldGeometry(info) : meshGeometry(info))
    return this.shapes.get(info)
  }

  /** The pose in a frame: its part that holds the geoms. */
  pose(frame) {
    const { layout, geoms } = this.description
    return frame.subarray(layout.geoms, layout.geoms + ROW * geoms.length)
  }

  /** Show pale copies of what moves in another pose, or none. */
  haunt(pose, sight) {
    if (pose?.length !== ROW * this.geoms.length) return this.ghosts.forEach((ghost) => ghost?.show(false))
    if (this.ghosts.length === 0) this.ghosts = this.geoms.map((solid, i) => (solid === null ? null : this.ghost(this.description.geoms[i])))
    const pale = pose.map((x, i) => (i % ROW === ROW - 1 ? PALE * x : x))
    this.place(this.ghosts, pale, 0, sight)
  }

  ghost(geom) {
    if (!this.description.bodies[geom.body].movable) return null
    const ghost = this.solid(geom)
    for (const mesh of ghost.meshes) mesh.castShadow = mesh.receiveShadow = false
    Object.assign(ghost.material, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 }) // behind the body where they coincide
    return ghost
  }

  /** Move everything to its place in a frame, and the ghost of a kept run, if there is one, to its pose. */
  update(frame, camera, ghost = null) {
    const { layout } = this.description
    const sight = { eye: camera.position(), target: camera.target }
    this.haunt(ghost, sight)
    this.place(this.geoms, frame, layout.geoms, sight)
    this.place(this.sites, frame, layout.sites, sight)
    this.skins.forEach((skin) => skin.update(frame))
    this.flexes.forEach((flex) => flex.update(frame))
    this.coils.forEach((coil) => coil.update(frame))
    const points = frame[2]
    this.trail?.update(frame, points)
    this.decorate(frame, layout.trail + 3 * points, frame[1], sight)
    this.floor?.update(camera.target)
    this.lights.update(frame, sight.eye, camera.axes().forward)
  }

  place(solids, frame, start, sight) {
    for (let i = 0, offset = start; i < solids.length; i++, offset += ROW) solids[i]?.update(frame, offset, offset + SIZE, offset + COLOUR, sight)
  }

  // Decorations come and go: those of the same type are reused, and the rest are hidden.
  decorate(frame, start, count, sight) {
    const counts = new Map()
    for (let i = 0, offset = start; i < count; i++, offset += DECORATION) {
      const type = frame[offset]
      const data = frame[offset + 1]
      const key = type === GEOM.MESH ? `mesh ${data >> 1}` : data === IN_FRONT ? `${type} in front` : type
      if (!this.decorations.has(key)) this.decorations.set(key, [])
      const pool = this.decorations.get(key)
      const next = counts.get(key) ?? 0
      if (next === pool.length) pool.push(this.decoration(type, data))
      counts.set(key, next + 1)
      const solid = pool[next]
      solid.update(frame, offset + 7, offset + 4, offset + 19, sight, frame[offset + 23])
    }
    for (const [key, pool] of this.decorations) for (let i = counts.get(key) ?? 0; i < pool.length; i++) pool[i].show(false)
  }

  decoration(type, data) {
    const geometry = this.geometry(type, data >> 1)
    const solid = new Solid(this.scene, this.materials, { type, geometry, model: false, extent: this.description.extent })
    for (const mesh of solid.meshes) mesh.castShadow = mesh.receiveShadow = false
    // A box of inertia may coincide with the faces of a geom: draw the decoration in front.
    Object.assign(solid.material, { polygonOffset: true, polygonOffsetFactor: -0.1, polygonOffsetUnits: -4 })
    if (data === IN_FRONT) {
      solid.material.depthTest = false
      for (const mesh of solid.meshes) mesh.renderOrder = 1
    }
    return solid
  }

  /**
   * The body under a point of the view, if it can move.
   *
   * @param {number} x @param {number} y in [-1, 1], to the right and up @param {import('three').Camera} lens
   * @returns {{body: number, point: number[]} | null} id and the point (m, world)
   */
  pick(x, y, lens) {
    this.raycaster.setFromCamera(new Vector2(x, y), lens)
    let best = null
    this.geoms.forEach((solid, i) => {
      const { body } = this.description.geoms[i]
      // A plane seen from below is transparent: the body behind it is meant.
      if (solid === null || solid.isBelow) return
      for (const hit of this.raycaster.intersectObjects(
        solid.meshes.filter((mesh) => mesh.visible),
        false,
      )) {
        if (best === null || hit.distance < best.distance) best = { body, distance: hit.distance, point: hit.point.toArray() }
      }
    })
    return best !== null && this.description.bodies[best.body].movable ? best : null
  }

  dispose() {
    this.lights.dispose()
    this.materials.dispose()
    this.mirror?.dispose()
    this.edges.dispose()
    this.floor?.dispose()
    for (const thing of [...this.shapes.values(), ...this.skins, ...this.flexes, ...this.coils, ...this.pins, this.trail]) thing?.dispose()
    for (const solid of [...this.geoms, ...this.sites, ...this.ghosts, ...[...this.decorations.values()].flat()]) solid?.remove()
    this.scene.clear()
  }
}

/** Set a three.js camera to a free camera, with MuJoCo's near and far planes, which are in extents of the model. */
export function aim(lens, camera, { extent, visual }, width, height) {
  const { right, up, forward } = camera.axes()
  const p = camera.position()
  lens.matrix.copy(
    new Matrix4().set(
      right[0], up[0], -forward[0], p[0],
      right[1], up[1], -forward[1], p[1],
      right[2], up[2], -forward[2], p[2],
      0, 0, 0, 1,
    ), // prettier-ignore
  )
  lens.aspect = width / Math.max(1, height)
  // A view narrower than 16 : 10 shows the same width as one of that shape.
  const half = Math.tan((camera.fovy * Math.PI) / 360) * Math.max(1, USUAL / lens.aspect)
  lens.fov = (Math.atan(half) * 360) / Math.PI
  lens.near = Math.min(visual.znear * extent, 0.2 * camera.distance)
  lens.far = Math.max(visual.zfar * extent, 4 * camera.distance)
  lens.updateProjectionMatrix()
  lens.updateMatrixWorld(true)
}
