/**
 * Moving a pose by a held point, while time stands still.
 *
 * What floats is moved as a whole, as by MuJoCo's viewer; otherwise the joints between the body and the world turn and slide, within
 * their limits, until the point is as near to its target as they allow (damped least squares). Velocities stay as they are.
 */

const ROUNDS = 20
const NEAR = 1e-5 // m
const LARGEST = 0.5 // rad or m, of a joint in a round
const DAMPING = 1e-4

export class Pose {
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
