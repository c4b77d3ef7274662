/**
 * The camera that shows all of a motion, as a photographer would: from a given direction, as near as the motion allows, with a margin.
 *
 *   const framing = new Framing(lab, camera)        its azimuth, elevation and fovy
 *   framing.begin(); framing.observe(lab); …        a run, and each moment of it
 *   framing.fit() → { distance, target } | null     null: nothing moves
 *
 * The run that Play alone gives is always shown. Others, in which a reader has changed something, are left out where they would take the
 * camera much farther away. So is
 * what falls out of the scene (`fallen`): bodies that begin above its lowest point and end far below, beside others that stay or a floor.
 *
 * A camera sees a point if the point lies on the inner side of the picture's four edges, each of which is a plane through the
 * camera. So of each moment only the `reach` is kept: how far the moving parts extend along the normals of these planes.
 * Coordinates are those of the camera: to the right, up, and into the picture.
 */

import { dot, toLocal } from './vectors.js'

const ASPECT = 1.6 // width of a view over its height
const MARGIN = 0.9 // part of the view that the motion may fill
const SURROUNDINGS = 0.3 // in sizes of the motion: what stands still and is nearer than this belongs in the picture
const FARTHEST = 1.5 // in distances of the camera for what Play does
const GAP = 0.04 // of the motion's size: between it and the floor
const LEVEL = 0.999
const SHOWN_GROUPS = 3
const RADIANS = Math.PI / 180
const UP = [0, 0, 1]
const AXES = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
const EDGES = AXES.length // where the normals of the edges begin

/** Unit vectors of a free camera's picture in the world: to the right, up, and into it. */
export function cameraAxes({ azimuth, elevation }) {
  const [a, e] = [azimuth * RADIANS, elevation * RADIANS]
  return {
    right: [Math.sin(a), -Math.cos(a), 0],
    up: [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)],
    forward: [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)],
  }
}

export class Framing {
  /** @param {import('./lab.js').Lab} lab @param {{azimuth: number, elevation: number, fovy: number}} camera in degrees */
  constructor({ engine, model, data }, camera) {
    const { right, up, forward } = cameraAxes(camera)
    this.world = ([x, y, z]) => right.map((r, i) => x * r + y * up[i] + z * forward[i])
    this.kinds = engine.k.geom
    const half = Math.tan((camera.fovy / 2) * RADIANS)
    this.slopes = [ASPECT * half, half] // of the picture's right and upper edge
    const [x, y] = this.slopes.map((slope) => MARGIN * slope)
    this.normals = [...AXES, [1, 0, -x], [-1, 0, -x], [0, 1, -y], [0, -1, -y]]
    this.directions = [...this.normals.map(this.world), [0, 0, -1]] // and down
    const visible = Array.from(model.geom_type, (_, i) => i).filter((i) => isShown(model, i))
    const moves = (i) => model.body_weldid[model.geom_bodyid[i]] !== 0 || model.body_mocapid[model.geom_bodyid[i]] >= 0
    this.movingGeoms = visible.filter(moves)
    this.stillGeoms = visible.filter((i) => !moves(i) && model.geom_type[i] > this.kinds.HFIELD)
    const { gravity } = model.opt
    this.falls = gravity[2] < 0 && Math.hypot(gravity[0], gravity[1]) < -gravity[2]
    const planes = visible.filter((i) => model.geom_type[i] === this.kinds.PLANE)
    this.tilted = planes.some((i) => data.geom_xmat[9 * i + 8] < LEVEL)
    this.planes = planes.map((i) => data.geom_xpos[3 * i + 2])
    const rootOf = (i) => model.body_rootid[model.geom_bodyid[i]]
    const fallible = this.movingGeoms.filter((i) => model.body_mocapid[rootOf(i)] < 0)
    this.trees = Map.groupBy(fallible, rootOf) // the geoms of each body that may fall, with all that it carries
    this.bottom = null // the depth of what the scene stands on, once a moment was observed
    this.fallen = new Map() // heights of the bodies that have fallen out of the scene
    this.runs = []
    this.played = 0 // the number of the run that Play alone gives
    this.stillReaches = []
  }

  begin() {
    this.runs.push([])
  }

  /** The moments of the run that Play gives. */
  get playedRun() {
    return this.runs[this.played]
  }

  /** The moments that a camera is to show. */
  get moments() {
    const farthest = this.distanceOf(this.playedRun) * FARTHEST
    return this.runs.flatMap((run) => (this.distanceOf([...this.playedRun, ...run]) <= farthest ? run : []))
  }

  distanceOf(moments) {
    return moments.length > 0 ? this.place(moments).distance : 0
  }

  /** Record a moment: the reach of what moves, of the points that tendons touch, and of the site that leaves a trail. */
  observe(lab) {
    const { model, sampler } = lab
    const { data } = lab.sync()
    const points = [...rows(data.flexvert_xpos, 0, model.nflexvert), ...rows(data.site_xpos, sampler.site, sampler.site < 0 ? 0 : 1)]
    for (let i = 0; i < model.ntendon; i++) points.push(...rows(data.wrap_xpos, data.ten_wrapadr[i], data.ten_wrapnum[i]))
    this.stillReaches = this.stillGeoms.map((i) => this.reachOf(model, data, i))
    const gone = this.falling(model, data)
    const staying = this.movingGeoms.filter((i) => !gone.has(model.body_rootid[model.geom_bodyid[i]]))
    if (staying.length + points.length === 0 && this.planes.length > 0) return
    const shown = staying.length + points.length > 0 ? staying : this.movingGeoms
    const reaches = [...shown.map((i) => this.reachOf(model, data, i)), ...points.map((p) => this.directions.map((d) => dot(p, d)))]
    const reach = furthest(reaches)
    if (reach.length > 0 && reach.every(Number.isFinite)) this.runs.at(-1).push(reach)
  }

  /** How far a geom reaches in all directions. */
  reachOf(model, data, i) {
    return this.directions.map((d) => this.support(model, data, i, d))
  }

  /** The top bodies that have fallen out of the scene by now: they are below all that stands still by more than the scene's first size. */
  falling(model, data) {
    const gone = new Set()
    if (!this.falls) return gone
    const height = (geoms) => Math.max(...geoms.map((i) => this.support(model, data, i, UP)))
    const tops = new Map([...this.trees].map(([body, geoms]) => [body, height(geoms)]))
    if (this.bottom === null) {
      this.bottom = Math.min(...this.planes, ...this.stillReaches.map((still) => -still.at(-1)))
      this.size = sizeOf(furthest([...this.movingGeoms.map((i) => this.reachOf(model, data, i)), ...this.stillReaches]))
      for (const [body, top] of tops) if (top < this.bottom) this.trees.delete(body)
    }
    for (const [body, top] of tops) {
      if (!this.trees.has(body) || !(top < this.bottom - this.size)) continue
      gone.add(body)
      this.fallen.set(body, top)
    }
    return gone
  }

  /** How far a geom reaches in a direction. */
  support(model, data, i, d) {
    const m = data.geom_xmat.subarray(9 * i, 9 * i + 9)
    const local = toLocal(m, d)
    const [a, b, c] = model.geom_size.subarray(3 * i, 3 * i + 3)
    const centre = dot(data.geom_xpos.subarray(3 * i, 3 * i + 3), d)
    const { SPHERE, CAPSULE, ELLIPSOID, CYLINDER } = this.kinds
    switch (model.geom_type[i]) {
      case SPHERE:
        return centre + a * Math.hypot(...local)
      case CAPSULE:
        return centre + a * Math.hypot(...local) + b * Math.abs(local[2])
      case ELLIPSOID:
        return centre + Math.hypot(a * local[0], b * local[1], c * local[2])
      case CYLINDER:
        return centre + a * Math.hypot(local[0], local[1]) + b * Math.abs(local[2])
      default: {
        const [x, y, z, ...halves] = model.geom_aabb.subarray(6 * i, 6 * i + 6)
        return centre + dot([x, y, z], local) + dot(halves, local.map(Math.abs))
      }
    }
  }

  /** The camera, or null where nothing moves. */
  fit() {
    const { moments } = this
    return moments.length > 0 ? this.place(moments) : null
  }

  /** The camera that sees all of these moments, and what stands still close to them. */
  place(moments) {
    const reach = furthest(moments)
    const room = reach.slice(0, EDGES).map((x) => x + SURROUNDINGS * sizeOf(reach))
    for (const still of this.stillReaches) {
      const clipped = room.map((x, i) => Math.min(x, still[i]))
      if ([0, 2, 4].some((i) => clipped[i] < -clipped[i + 1])) continue
      this.normals.forEach((normal, i) => {
        const corner = normal.reduce((sum, n, j) => sum + Math.max(n * clipped[2 * j], -n * clipped[2 * j + 1]), 0)
        reach[i] = Math.max(reach[i], corner)
      })
    }
    const [right, left, top, bottom] = reach.slice(EDGES)
    const [x, y] = this.slopes.map((slope) => MARGIN * slope)
    const depth = Math.min(-(right + left) / (2 * x), -(top + bottom) / (2 * y))
    const middle = (reach[4] - reach[5]) / 2
    return { distance: middle - depth, target: this.world([(right - left) / 2, (top - bottom) / 2, middle]) }
  }

  /** The height of the floor: that of the model's level plane, else below everything; null if nothing falls or the plane is tilted. */
  floor() {
    const { moments } = this
    if (!this.falls || this.tilted || moments.length === 0) return null
    if (this.planes.length > 0) return Math.max(...this.planes)
    const reach = furthest(moments)
    const size = sizeOf(reach)
    const feet = this.stillReaches.map((still) => still.at(-1)).filter((depth) => depth < reach.at(-1) + 2 * size)
    return -Math.max(reach.at(-1) + GAP * size, ...feet)
  }

  /** The part of a camera's picture that the rectangle around all of the motion fills that Play gives. */
  fill({ distance, target }) {
    const [x, y, z] = this.directions.filter((_, i) => i < EDGES && i % 2 === 0).map((d) => dot(target, d))
    const clipped = (value) => Math.max(-1, Math.min(value, 1))
    const sides = this.playedRun.map(([right, left, top, bottom, back, front]) => {
      const depth = Math.max(1e-9, (back - front) / 2 - z + distance)
      const [w, h] = this.slopes.map((slope) => slope * depth)
      return [(right - x) / w, (left + x) / w, (top - y) / h, (bottom + y) / h].map(clipped)
    })
    const [right, left, top, bottom] = furthest(sides)
    return ((right + left) * (top + bottom)) / 4
  }
}

const furthest = ([first = [], ...others]) => first.map((x, i) => Math.max(x, ...others.map((other) => other[i])))
const sizeOf = (reach) => Math.max(...[0, 2, 4].map((i) => reach[i] + reach[i + 1]))
const rows = (array, start, count) => Array.from({ length: count }, (_, i) => array.subarray(3 * (start + i), 3 * (start + i) + 3))

/** Whether a geom is drawn, by its group and its colour. */
export function isShown(model, i) {
  const material = model.geom_matid[i]
  const alphaOfGeom = model.geom_rgba[4 * i + 3]
  const alpha = material >= 0 && alphaOfGeom === 1 ? model.mat_rgba[4 * material + 3] : alphaOfGeom
  return model.geom_group[i] < SHOWN_GROUPS && alpha > 0
}
