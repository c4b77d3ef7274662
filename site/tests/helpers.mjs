/** What the tests of the labs share: the engine under Node, models, and small labs. */

import './new-in-node.mjs'
import { readFileSync } from 'node:fs'
import loadMujoco from '@mujoco/mujoco'
import { createEngine } from '../js/lab/core/engine.js'
import { Lab } from '../js/lab/core/lab.js'
import { saveModel } from '../js/lab/trial/parity.js'

export const here = (name) => new URL(name, import.meta.url)
export const wasm = new WebAssembly.Module(readFileSync(new URL(import.meta.resolve('@mujoco/mujoco/mujoco.wasm'))))
export { loadMujoco }

/** A new engine; most tests of a file share one. */
export const newEngine = (log) => createEngine(loadMujoco, wasm, log)

/** An MJCF text as the bytes of a compiled model. */
export function compile(engine, xml) {
  const model = engine.mj.MjModel.from_xml_string(xml)
  try {
    return saveModel({ engine, model })
  } finally {
    model.delete()
  }
}

/** A lab's data with nothing in it but what is said. */
export const config = (fields = {}) => ({
  id: 'test-lab-1',
  title: 'test',
  key: null,
  camera: null,
  toggles: [],
  overlays: [],
  forceScale: null,
  autoplay: false,
  stopAt: null,
  trail: null,
  seed: null,
  controls: [],
  readouts: [],
  plots: [],
  expect: [],
  ...fields,
})

/** A control's data with nothing in it but what is said. */
export const control = (fields) => ({
  type: 'slider',
  label: 'control',
  unit: '',
  min: null,
  max: null,
  step: null,
  value: null,
  digits: null,
  options: [],
  param: null,
  init: false,
  reset: false,
  ...fields,
})

/** A lab's code with nothing in it but what is said. */
export const code = (fields = {}) => ({ controls: [], readouts: [], plots: [], expect: [], ...fields })

/** A plot of the given expressions. */
export const plot = (count, fields = {}) => ({
  window: null,
  refLines: [],
  traces: Array.from({ length: count }, (_, i) => ({ label: `trace ${i}`, dash: false })),
  ...fields,
})

/** A lab of an MJCF text, disposed of after the test. */
export function labOf(t, engine, xml, data = {}, functions = {}, host = {}) {
  const lab = new Lab(engine, compile(engine, xml), config(data), code(functions), host)
  t.after(() => lab.dispose())
  return lab
}

export const FALLING = `<mujoco><worldbody>
  <body name="ball" pos="0 0 1"><freejoint/><geom name="ball" size=".1" mass="2"/><site name="top" pos="0 0 .1"/></body>
</worldbody></mujoco>`

export const PENDULUM = `<mujoco><option timestep="0.002"/><worldbody>
  <body name="arm"><joint name="hinge" axis="0 1 0" damping=".01"/><geom name="bob" type="capsule" size=".02 .2" pos="0 0 -.2"/></body>
</worldbody><actuator><motor joint="hinge" ctrlrange="-1 1"/></actuator><keyframe><key name="up" qpos="3"/></keyframe></mujoco>`
