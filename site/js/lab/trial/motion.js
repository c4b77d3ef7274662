/**
 * How much of the picture what moves sweeps after Play: what a reader sees who presses nothing else.
 *
 *   const motion = new Motion(lab); motion.observe(lab); …
 *   motion.share(camera) → 0 to 1
 *
 * Of each shown geom eight points are followed, the corners of its box; of round ones those that turning does not move. What moves by
 * less than a hundredth of the picture's height counts as standing. The rectangles around the others are added up, on a grid.
 */

import { cameraAxes, Framing, isShown } from '../core/framing.js'
import { dot } from '../core/vectors.js'
import { packed, withSmallTextures } from './record.js'

const SECONDS = 3
const MOMENTS = 60 // at which a run is looked at
const LEAST = 0.01 // of the picture's height
const [WIDE, HIGH] = [160, 100] // cells
const SIGNS = Array.from({ length: 8 }, (_, i) => [i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1])

export class Motion {
  constructor({ engine, model, time }) {
    this.end = time + SECONDS
    this.round = [engine.k.geom.SPHERE, engine.k.geom.CAPSULE, engine.k.geom.CYLINDER]
    this.geoms = Array.from(model.geom_type, (_, i) => i).filter((i) => isShown(model, i) && model.geom_type[i] > engine.k.geom.HFIELD)
    this.radii = this.geoms.map((i) => (this.round.includes(model.geom_type[i]) ? model.geom_size[3 * i] : 0))
    this.moments = [] // of each geom and flex: its points
  }

  observe(lab) {
    if (lab.time > this.end) return
    const { model } = lab
    const { data } = lab.sync()
    const things = this.geoms.map((i) => this.points(model, data, i))
    for (let i = 0; i < model.nflexvert; i++) things.push([[...data.flexvert_xpos.subarray(3 * i, 3 * i + 3)]])
    this.moments.push(things)
  }

  points(model, data, i) {
    const centre = data.geom_xpos.subarray(3 * i, 3 * i + 3)
    const m = data.geom_xmat.subarray(9 * i, 9 * i + 9)
    const [x, y, z, ...halves] = model.geom_aabb.subarray(6 * i, 6 * i + 6)
    const kind = this.round.indexOf(model.geom_type[i])
    if (kind === 0) return [[...centre]]
    const places = kind > 0 ? [-1, 1].map((s) => [0, 0, s * halves[2]]) : SIGNS.map((s) => [x, y, z].map((c, j) => c + s[j] * halves[j]))
    return places.map((place) => [0, 1, 2].map((j) => centre[j] + dot(m.subarray(3 * j, 3 * j + 3), place)))
  }

  /**
   * The part of the picture in which something is seen to move.
   *
   * @param {{azimuth: number, elevation: number, distance: number, target: number[], fovy: number}} camera
   */
  share(camera) {
    const { right, up, forward } = cameraAxes(camera)
    const slope = Math.tan((camera.fovy * Math.PI) / 360)
    const seen = (point) => {
      const p = point.map((x, j) => x - camera.target[j])
      const scale = HIGH / (2 * slope * Math.max(1e-9, dot(p, forward) + camera.distance)) // cells for each metre
      return [WIDE / 2 + scale * dot(p, right), HIGH / 2 - scale * dot(p, up), scale]
    }
    const moments = this.moments.map((things) => things.map((points) => points.map(seen)))
    const moves = (k) => moments.some((things) => things[k].some((p, j) => Math.hypot(p[0] - moments[0][k][j][0], p[1] - moments[0][k][j][1]) > LEAST * HIGH))
    const cells = new Uint8Array(WIDE * HIGH)
    for (let k = 0; k < (moments[0]?.length ?? 0); k++) {
      if (moves(k)) moments.forEach((things) => cover(cells, things[k], this.radii[k] ?? 0))
    }
    return cells.reduce((sum, cell) => sum + cell, 0) / cells.length
  }
}

/**
 * What a reader sees in the first seconds who plays what an exercise begins with, in a camera that shows all of it: `moved`, the part of the
 * picture, or null if the lab cannot run; and `begin`, the `scene` and the `pictures` of the start, as in a trial's main run, or null if there is none.
 *
 * @param {() => import('../core/lab.js').Lab} open
 */
export function played(open) {
  let lab = null
  const seen = { moved: null, begin: null }
  try {
    lab = open()
    lab.start()
    const { start, controls, camera: placed } = lab.config
    const scene = withSmallTextures(lab.scene())
    const { camera } = scene
    seen.begin = { scene, pictures: [{ frame: lab.frame(null).slice() }] }
    const framing = new Framing(lab, camera)
    const motion = new Motion(lab)
    framing.begin()
    framing.observe(lab)
    const button = controls.findIndex(({ label }) => label === start)
    if (button >= 0) lab.press(button)
    const slice = Math.max(1, Math.round(SECONDS / MOMENTS / lab.option.timestep)) // steps
    do {
      framing.observe(lab)
      motion.observe(lab)
    } while (lab.step(slice).steps > 0 && lab.diverged === null && lab.time <= motion.end)
    const fitting = camera.orthographic ? null : framing.fit()
    if (fitting !== null && placed?.distance == null && placed?.target == null) Object.assign(camera, fitting)
    scene.floor = framing.floor()
    seen.moved = fitting === null ? 0 : motion.share(camera)
  } catch {
    // The trials tell what is wrong.
  } finally {
    lab?.dispose()
  }
  return packed(seen)
}

/** Mark the cells of the rectangle around some points, each of which has a radius in metres around it. */
function cover(cells, points, radius) {
  const low = (j) => Math.max(0, Math.floor(Math.min(...points.map((p) => p[j] - radius * p[2]))))
  const high = (j, end) => Math.min(end - 1, Math.ceil(Math.max(...points.map((p) => p[j] + radius * p[2]))))
  const [left, top, right, bottom] = [low(0), low(1), high(0, WIDE), high(1, HIGH)]
  for (let y = top; y <= bottom; y++) if (right >= left) cells.fill(1, y * WIDE + left, y * WIDE + right + 1)
}
