/**
 * What a model offers to a reader beside the lab's own controls: its actuators, sensors, cameras and keyframes, by their names.
 *
 * An actuator is `driven` if the lab's own code sets it: then what a reader sets does not last. Code that names an element of `ctrl` is
 * known beforehand; other code is noticed as soon as it has changed an element.
 */

import { nameOf } from './names.js'

const USUAL_RANGE = [-1, 1] // of an actuator without limits, as in MuJoCo's viewer
const PERSPECTIVE = 0
const WRITES = /\bctrl\s*\[\s*(\d+)\s*\]\s*[-+*/]?=(?!=)/g

export class Panel {
  /** @param {import('./lab.js').Lab} lab */
  constructor(lab) {
    this.lab = lab
    this.driven = new Uint8Array(lab.model.nu)
    this.before = new Float64Array(lab.model.nu)
    const { controller, controls } = lab.code
    const sources = [controller, ...controls.map(({ set }) => set)].map(String).join('\n')
    for (const [, i] of sources.matchAll(WRITES)) if (Number(i) < this.driven.length) this.driven[i] = 1
  }

  /**
   * What there is: actuators with their ranges, sensors with the length of their values, cameras and keyframes with their numbers.
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
    }
  }

  /** The present values. @returns {{ctrl: Float64Array, sensors: Float64Array, driven: Uint8Array}} copies */
  read() {
    const { lab, driven } = this
    const { sensordata } = lab.sync().data
    return { ctrl: Float64Array.from(lab.data.ctrl), sensors: Float64Array.from(sensordata), driven: driven.slice() }
  }

  /** Run code of the lab, and note which actuators it sets. */
  watch(code) {
    this.before.set(this.lab.data.ctrl)
    code()
    const { ctrl } = this.lab.data
    for (let i = 0; i < ctrl.length; i++) if (ctrl[i] !== this.before[i]) this.driven[i] = 1
  }
}
