/**
 * MuJoCo's free camera, and how the mouse moves it (mjv_moveCamera). No DOM, no drawing.
 *
 * The camera looks at `target` from `distance`; `azimuth` turns about z and `elevation` is negative where it looks down, both
 * in degrees. World lengths in metres, z up. Movements are in parts of the view's height, as in MuJoCo.
 */

import { cameraAxes } from '../core/framing.js'

const STEEPEST = 90

export class OrbitCamera {
  /** @param {{azimuth: number, elevation: number, distance: number, target: number[], fovy?: number}} start degrees, metres */
  constructor(start) {
    this.start = { ...start, target: [...start.target] }
    this.reset()
  }

  reset() {
    const { azimuth, elevation, distance, target, fovy = 45 } = this.start
    this.azimuth = azimuth
    this.elevation = elevation
    this.distance = distance
    this.fovy = fovy
    this.target = [...target]
  }

  /** Unit vectors of the picture in the world: to the right, up, and into it. */
  axes() {
    return cameraAxes(this)
  }

  /** Where the camera is (m). */
  position() {
    const { forward } = this.axes()
    return this.target.map((x, i) => x - this.distance * forward[i])
  }

  /** Turn about the target: a view's height of movement is half a turn. */
  rotate(dx, dy) {
    this.azimuth -= 180 * dx
    this.elevation = Math.min(STEEPEST, Math.max(-STEEPEST, this.elevation - 180 * dy))
  }

  /** Move with the picture: what is at the target's depth follows the pointer. */
  pan(dx, dy) {
    const height = 2 * this.distance * Math.tan((this.fovy * Math.PI) / 360)
    const { right, up } = this.axes()
    this.target = this.target.map((x, i) => x + height * (dy * up[i] - dx * right[i]))
  }

  /** Come nearer (`factor` below 1) or go away. */
  zoom(factor) {
    const { distance } = this.start
    this.distance = Math.min(1000 * distance, Math.max(0.01 * distance, this.distance * factor))
  }
}

/** A camera of the model. It goes where the model moves it, and no hand turns it. */
export class ModelCamera {
  /** @param {number} start of its numbers in a frame (core/frame.js); @param {number} distance (m) at which the scale is right */
  constructor(start, distance) {
    this.start = start
    this.distance = distance
  }

  /** Take its place from a frame. @param {Float32Array} frame */
  follow(frame) {
    this.place = Array.from(frame.subarray(this.start, this.start + 3))
    this.matrix = frame.slice(this.start + 3, this.start + 12)
    this.fovy = frame[this.start + 12]
  }

  axes() {
    const column = (j, sign = 1) => [0, 3, 6].map((row) => sign * this.matrix[row + j])
    return { right: column(0), up: column(1), forward: column(2, -1) }
  }

  position() {
    return this.place
  }

  rotate() {}

  pan() {}

  zoom() {}

  reset() {}
}
