/**
 * What a model offers to a reader beside the lab's own controls: its actuators, sensors, cameras, keyframes and parts, by their names.
 *
 * An actuator is `driven` if the lab's own code sets it: then what a reader sets does not last. Code that names an element of `ctrl` is
 * known beforehand; other code is noticed as soon as it has changed an element.
 */

import { nameOf } from './names.js'

const USUAL_RANGE = [-1, 1] // of an actuator without limits, as in MuJoCo's viewer
const PERSPECTIVE = 0
const BODY_ROWS = ['xpos', 'xquat', 'xipos', 'subtree_com', 'cvel', 'xfrc_applied']
const GEOM_ROWS = ['geom_xpos', 'geom_xmat']
const JOINT_ROWS = ['xanchor', 'xaxis']
const DOF_ROWS = ['qvel', 'qacc', 'qfrc_applied', 'qfrc_passive', 'qfrc_actuator', 'qfrc_constraint', 'qfrc_bias']
const PREFIXES = ['body_', 'jnt_', 'dof_', 'geom_'] // of the arrays of a model whose numbers are shown
const COORDINATES = [7, 4, 1, 1] // of a joint, by its mjtJoint
const FREEDOMS = [6, 3, 1, 1]
const WRITES = /\bctrl\s*\[\s*(\d+)\s*\]\s*[-+*/]?=(?!=)/g

export class Panel {
  /** @param {import('./lab.js').Lab} lab */
  constructor(lab) {
    this.lab = lab
    /** @type {{kind: string, index: number} | null} the part of the model whose numbers are read with each frame */
    this.part = null
    this.names = Object.fromEntries(PREFIXES.map((prefix) => [prefix, namesOf(lab.model, prefix)]))
    this.driven = new Uint8Array(lab.model.nu)
    this.before = new Float64Array(lab.model.nu)
    const { controller, controls } = lab.code
    const sources = [controller, ...controls.map(({ set }) => set)].map(String).join('\n')
    for (const [, i] of sources.matchAll(WRITES)) if (Number(i) < this.driven.length) this.driven[i] = 1
  }

  /**
   * What there is: actuators with their ranges, sensors with the length of their values, cameras and keyframes with their numbers, and
   * the tree of bodies, each with its joints and geoms.
   * What has no name is called by its kind and number.
   */
  describe() {
    const { engine, model } = this.lab
    const { k, mj } = engine
    const list = (count, make) => Array.from({ length: count }, (_, i) => make(i))
    const name = (type, i, kind) => nameOf(engine, model, type, i) || `${kind} ${i}`
    const sensorKinds = Object.keys(mj.mjtSensor).filter((key) => key.startsWith('mjSENS_'))
    const kindOf = (type) => sensorKinds.find((key) => mj.mjtSensor[key].value === type).slice(7).toLowerCase()
    const { actuator_ctrllimited: limited, actuator_ctrlrange: ranges, sensor_type: types, sensor_dim: sizes } = model
    return {
      actuators: list(model.nu, (i) => {
        const [min, max] = limited[i] ? ranges.slice(2 * i, 2 * i + 2) : USUAL_RANGE
        return { name: name(k.obj.ACTUATOR, i, 'actuator'), min, max }
      }),
      sensors: list(model.nsensor, (i) => ({ name: name(k.obj.SENSOR, i, kindOf(types[i])), size: sizes[i] })),
      cameras: list(model.ncam, (i) => ({ name: name(k.obj.CAMERA, i, 'camera'), index: i })).filter(
        ({ index }) => model.cam_projection[index] === PERSPECTIVE,
      ),
      keys: list(model.nkey, (i) => name(k.obj.KEY, i, 'keyframe')),
      parts: this.tree(),
    }
  }

  /** Bodies in MuJoCo's order, which goes down each branch, with their joints and geoms. What has no name has its number. */
  tree() {
    const { engine, model } = this.lab
    const { BODY, JOINT, GEOM } = engine.k.obj
    const depths = []
    const parts = []
    const add = (kind, type, index, depth) => parts.push({ kind, index, depth, name: nameOf(engine, model, type, index) || String(index) })
    for (let body = 0; body < model.nbody; body++) {
      const depth = body === 0 ? 0 : depths[model.body_parentid[body]] + 1
      depths.push(depth)
      add('body', BODY, body, depth)
      for (let i = 0; i < model.body_jntnum[body]; i++) add('joint', JOINT, model.body_jntadr[body] + i, depth + 1)
      for (let i = 0; i < model.body_geomnum[body]; i++) add('geom', GEOM, model.body_geomadr[body] + i, depth + 1)
    }
    return parts
  }

  /** The numbers of the chosen part in mjModel, then in mjData, under MuJoCo's names. @returns {[string, Float64Array][] | null} copies */
  rows(data) {
    if (this.part === null) return null
    const { model } = this.lab
    const { kind, index } = this.part
    const cut = (from, name, start, count) => [name, Float64Array.from(from[name].subarray(start, start + count))]
    const each = (from, names, count) => names.map((name) => cut(from, name, (index * from[name].length) / count, from[name].length / count))
    if (kind === 'body') return [...each(model, this.names.body_, model.nbody), ...each(data, BODY_ROWS, model.nbody)]
    if (kind === 'geom') return [...each(model, this.names.geom_, model.ngeom), ...each(data, GEOM_ROWS, model.ngeom)]
    const [coordinate, dof] = [model.jnt_qposadr[index], model.jnt_dofadr[index]]
    const [coordinates, dofs] = [COORDINATES, FREEDOMS].map((counts) => counts[model.jnt_type[index]])
    const ofDofs = (from, names) => names.map((name) => cut(from, name, (dof * from[name].length) / model.nv, (dofs * from[name].length) / model.nv))
    return [
      ...each(model, this.names.jnt_, model.njnt),
      ...ofDofs(model, this.names.dof_),
      ...each(data, JOINT_ROWS, model.njnt),
      cut(data, 'qpos', coordinate, coordinates),
      ...ofDofs(data, DOF_ROWS),
    ]
  }

  /** The present values; `rows` of the chosen part. @returns {{ctrl: Float64Array, sensors: Float64Array, driven: Uint8Array, rows: [string, Float64Array][] | null}} copies */
  read() {
    const { lab, driven } = this
    const { data } = lab.sync()
    return { ctrl: Float64Array.from(lab.data.ctrl), sensors: Float64Array.from(data.sensordata), driven: driven.slice(), rows: this.rows(data) }
  }

  /** Run code of the lab, and note which actuators it sets. */
  watch(code) {
    this.before.set(this.lab.data.ctrl)
    code()
    const { ctrl } = this.lab.data
    for (let i = 0; i < ctrl.length; i++) if (ctrl[i] !== this.before[i]) this.driven[i] = 1
  }
}

/** The arrays of a model whose names begin so and that have numbers. @returns {string[]} in alphabetical order */
function namesOf(model, prefix) {
  const names = new Set()
  for (let type = Object.getPrototypeOf(model); type !== Object.prototype; type = Object.getPrototypeOf(type)) {
    for (const name of Object.getOwnPropertyNames(type)) if (name.startsWith(prefix) && model[name].length > 0) names.add(name)
  }
  return [...names].sort()
}
