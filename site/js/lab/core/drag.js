/**
 * Dragging a body with a spring, as MuJoCo's viewer does.
 *
 * The spring is MuJoCo's own (`mjv_applyPerturbForce`: critically damped, its stiffness that of the model, scaled by the mass
 * felt at the point). Its force is added to what the author's code has put into `xfrc_applied`, for the length of a step only.
 */

import { toLocal, toWorld } from './vectors.js'

const ROUNDS = 20
const NEAR = 1e-5 // m
const LARGEST = 0.5 // rad or m, of a joint in a round
const DAMPING = 1e-4

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
    handle.localpos.set(toLocal(rotationOf(data, body), point.map((x, i) => x - data.xpos[3 * body + i])))
    mj.mjv_initPerturb(model, data, this.scene, handle)
    this.move(point)
    return true
  }

  /** Where the held point is drawn to (m, world). */
  move(target) {
    if (!this.active) return
    this.handle.refselpos.set(target)
    if (this.mocap < 0) return
    const offset = toWorld(rotationOf(this.data, this.body), this.handle.localpos)
    this.data.mocap_pos.set(target.map((x, i) => x - offset[i]), 3 * this.mocap)
  }

  /** Move the pose so that the held point comes to where it is drawn, as far as joints allow; for a simulation that stands still. */
  pose() {
    if (!this.active || this.mocap >= 0) return
    const { data, body, handle } = this
    this.poser ??= new Pose(this.engine, this.handles)
    const held = () => toWorld(rotationOf(data, body), handle.localpos).map((x, i) => x + data.xpos[3 * body + i])
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

const rotationOf = ({ xmat }, body) => xmat.subarray(9 * body, 9 * body + 9)

/**
 * Moving a pose by a held point, while time stands still.
 *
 * What floats is moved as a whole, as by MuJoCo's viewer; otherwise the joints between the body and the world turn and slide, within
 * their limits, until the point is as near to its target as they allow (damped least squares). Velocities stay as they are.
 */
class Pose {
  /** @param {import('./engine.js').Engine} engine; @param {import('./engine.js').Handles} handles */
  constructor(engine, handles) {
    this.engine = engine
    this.model = handles.model
    this.data = handles.data
    const { nv } = this.model
    const buffer = (size) => handles.adopt(new engine.mj.DoubleBuffer(Math.max(1, size)))
    this.jacobian = buffer(3 * nv)
    this.rotation = buffer(3 * nv)
  }

  /**
   * Move the pose; what is derived from it is current only as far as places go.
   *
   * @param {number} body @param {() => number[]} held where the held point is (m, world) @param {number[]} target of that point
   */
  move(body, held, target) {
    const { model, data, engine } = this
    const root = model.body_rootid[body]
    const joint = model.body_jntadr[root]
    if (joint >= 0 && model.jnt_type[joint] === engine.k.joint.FREE) {
      const start = model.jnt_qposadr[joint]
      held().forEach((x, i) => (data.qpos[start + i] += target[i] - x))
      return
    }
    for (let round = 0; round < ROUNDS; round++) {
      const point = held()
      const away = target.map((x, i) => x - point[i])
      if (Math.hypot(...away) < NEAR) return
      this.turn(body, point, away)
    }
  }

  /** One round: turn and slide the joints so that the point comes nearer to its target. */
  turn(body, point, away) {
    const { engine, model, data } = this
    const { mj } = engine
    const { nv } = model
    mj.mj_jac(model, data, this.jacobian, this.rotation, point, body)
    const J = this.jacobian.GetView()
    const row = (i) => J.subarray(i * nv, (i + 1) * nv)
    const product = [0, 1, 2].map((i) => [0, 1, 2].map((j) => row(i).reduce((sum, x, n) => sum + x * row(j)[n], 0)))
    const damping = DAMPING * (product[0][0] + product[1][1] + product[2][2])
    if (damping === 0) return
    for (let i = 0; i < 3; i++) product[i][i] += damping
    const weights = solve(product, away)
    const change = Array.from({ length: nv }, (_, n) => weights.reduce((sum, w, i) => sum + w * row(i)[n], 0))
    const largest = Math.max(...change.map(Math.abs))
    const scale = Math.min(1, LARGEST / largest)
    mj.mj_integratePos(model, data.qpos, change, scale)
    this.limit()
    mj.mj_kinematics(model, data)
    mj.mj_comPos(model, data)
  }

  /** Put hinges and slides back into their ranges. */
  limit() {
    const { engine, model, data } = this
    const { HINGE, SLIDE } = engine.k.joint
    const { jnt_limited: limited, jnt_type: types, jnt_range: ranges, jnt_qposadr: starts } = model
    for (let i = 0; i < model.njnt; i++) {
      if (!limited[i] || (types[i] !== HINGE && types[i] !== SLIDE)) continue
      const [low, high] = ranges.subarray(2 * i, 2 * i + 2)
      data.qpos[starts[i]] = Math.min(high, Math.max(low, data.qpos[starts[i]]))
    }
  }
}

/** Solve three linear equations by Cramer's rule. */
function solve(A, b) {
  const det = ([p, q, r]) => p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0]) + p[2] * (q[0] * r[1] - q[1] * r[0])
  const whole = det(A)
  return [0, 1, 2].map((j) => det(A.map((row, i) => row.map((x, k) => (k === j ? b[i] : x)))) / whole)
}
