/**
 * Dragging a body with a spring, as MuJoCo's viewer does.
 *
 * The spring is MuJoCo's own (`mjv_applyPerturbForce`: critically damped, its stiffness that of the model, scaled by the mass
 * felt at the point). Its force is added to what the author's code has put into `xfrc_applied`, for the length of a step only.
 */

import { Pose } from './pose.js'

export class Drag {
  /**
   * @param {import('./engine.js').Engine} engine
   * @param {import('./engine.js').Handles} handles
   * @param {Record<string, any>} scene MjvScene, whose camera has been set
   */
  constructor(engine, handles, scene) {
    this.engine = engine
    this.handles = handles
    this.model = handles.model
    this.data = handles.data
    this.scene = scene
    this.handle = handles.adopt(new engine.mj.MjvPerturb())
    this.body = -1
    this.authorForce = new Float64Array(6)
    /** @type {Pose | null} made when it is first needed */
    this.poser = null
  }

  get active() {
    return this.body >= 0
  }

  /**
   * Take hold of a body that can move.
   *
   * @param {number} body id
   * @param {number[]} point in the world (m): where it is held; the data's derived quantities must be current
   * @returns {boolean} whether there is anything to move
   */
  grab(body, point) {
    const { mj, k } = this.engine
    const { model, data, handle } = this
    this.release()
    if (!(body > 0 && body < model.nbody)) return false
    this.mocap = model.body_mocapid[body]
    if (model.body_weldid[body] === 0 && this.mocap < 0) return false
    this.body = body
    handle.select = body
    handle.active = k.perturb.TRANSLATE
    handle.localpos.set(toLocal(data, body, point))
    mj.mjv_initPerturb(model, data, this.scene, handle)
    this.move(point)
    return true
  }

  /** Where the held point is drawn to (m, world). */
  move(target) {
    if (!this.active) return
    this.handle.refselpos.set(target)
    if (this.mocap < 0) return
    const offset = fromLocal(this.data, this.body, this.handle.localpos)
    this.data.mocap_pos.set(target.map((x, i) => x - offset[i]), 3 * this.mocap)
  }

  /** Move the pose so that the held point comes to where it is drawn, as far as joints allow; for a simulation that stands still. */
  pose() {
    if (!this.active || this.mocap >= 0) return
    const { data, body, handle } = this
    this.poser ??= new Pose(this.engine, this.handles)
    const held = () => fromLocal(data, body, handle.localpos).map((x, i) => x + data.xpos[3 * body + i])
    this.poser.move(body, held, Array.from(handle.refselpos))
  }

  release() {
    this.body = -1
    this.handle.active = 0
    this.handle.select = 0
  }

  /** Add the spring's force, before a step. */
  push() {
    if (!this.active || this.mocap >= 0) return
    const { engine, model, data } = this
    const force = data.xfrc_applied.subarray(6 * this.body, 6 * this.body + 6)
    this.authorForce.set(force)
    engine.mj.mjv_applyPerturbForce(model, data, this.handle)
    for (let i = 0; i < 6; i++) force[i] += this.authorForce[i]
  }

  /** Take it away again, after the step. */
  pop() {
    if (!this.active || this.mocap >= 0) return
    this.data.xfrc_applied.set(this.authorForce, 6 * this.body)
  }
}

function toLocal(data, body, point) {
  const R = data.xmat.subarray(9 * body, 9 * body + 9)
  const d = [0, 1, 2].map((i) => point[i] - data.xpos[3 * body + i])
  return [0, 1, 2].map((j) => R[j] * d[0] + R[3 + j] * d[1] + R[6 + j] * d[2])
}

/** From the origin of the body to a point of it, in world axes. */
function fromLocal(data, body, local) {
  const R = data.xmat.subarray(9 * body, 9 * body + 9)
  return [0, 1, 2].map((i) => R[3 * i] * local[0] + R[3 * i + 1] * local[1] + R[3 * i + 2] * local[2])
}
