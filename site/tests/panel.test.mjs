/** What a model offers beside a lab's controls: its actuators and sensors by name, keyframes, and who sets an actuator. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { control, labOf, newEngine } from './helpers.mjs'

const engine = await newEngine()
const CART = `<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <camera name="front"/>
    <camera projection="orthographic"/>
    <body>
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="2"/>
      <camera/>
      <site name="middle"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="push" joint="slide" ctrllimited="true" ctrlrange="-4 8"/>
    <motor joint="slide"/>
  </actuator>
  <sensor>
    <jointvel name="speed" joint="slide"/>
    <framepos objtype="site" objname="middle"/>
  </sensor>
  <keyframe>
    <key name="far" qpos="3"/>
    <key qpos="5"/>
  </keyframe>
</mujoco>`

test('a model is described by its names, and by kind and number where it has none', (t) => {
  const lab = labOf(t, engine, CART)
  assert.deepEqual(lab.inspect(true), {
    actuators: [
      { name: 'push', min: -4, max: 8 },
      { name: 'actuator 1', min: -1, max: 1 },
    ],
    sensors: [
      { name: 'speed', size: 1 },
      { name: 'framepos 1', size: 3 },
    ],
    cameras: [
      { name: 'front', index: 0 },
      { name: 'camera 2', index: 2 },
    ],
    keys: ['far', 'keyframe 1'],
    parts: [
      { kind: 'body', index: 0, depth: 0, name: 'world' },
      { kind: 'body', index: 1, depth: 1, name: '1' },
      { kind: 'joint', index: 0, depth: 2, name: 'slide' },
      { kind: 'geom', index: 0, depth: 2, name: '0' },
    ],
  })
  assert.equal(lab.inspect(false), null)
  assert.equal(lab.panel, null)
})

test('the tree goes down each branch, and a part is read under the names of MuJoCo', (t) => {
  const lab = labOf(
    t,
    engine,
    `<mujoco><worldbody><geom type="plane" size="1 1 1"/>
      <body name="left" pos="0 0 1"><joint name="free" type="free"/><geom name="ball" size="0.1" mass="3"/></body>
      <body name="right"><joint name="lift" type="slide" axis="0 0 1" damping="5"/><geom size="0.1"/>
        <body name="hand" pos="1 0 0"><joint name="wrist" type="ball"/><geom size="0.1"/></body></body>
    </worldbody></mujoco>`,
  )
  const { parts } = lab.inspect(true)
  const bodies = parts.filter(({ kind }) => kind === 'body').map(({ name, depth }) => [name, depth])
  assert.deepEqual(bodies, [['world', 0], ['left', 1], ['right', 1], ['hand', 2]]) // prettier-ignore
  const read = (kind, name) => {
    lab.panel.part = parts.find((part) => part.kind === kind && part.name === name)
    return Object.fromEntries(lab.panel.read().rows.map(([key, values]) => [key, Array.from(values)]))
  }
  lab.step(100)
  const { data } = lab.sync()
  assert.deepEqual(read('body', 'left').body_mass, [3])
  assert.deepEqual(read('body', 'hand').xpos, Array.from(data.xpos.subarray(9, 12)))
  assert.deepEqual(read('geom', 'ball').geom_size, [0.1, 0, 0])
  assert.deepEqual(read('joint', 'lift').qpos, [data.qpos[7]])
  assert.deepEqual(read('joint', 'lift').dof_damping, [5])
  assert.deepEqual(read('joint', 'free').qvel, Array.from(data.qvel.subarray(0, 6)))
  assert.deepEqual(read('joint', 'wrist').qpos, Array.from(data.qpos.subarray(8, 12)))
  assert.deepEqual(read('joint', 'wrist').qfrc_bias, Array.from(data.qfrc_bias.subarray(7, 10)))
  lab.panel.part = null
  assert.equal(lab.panel.read().rows, null)
})

test('an actuator that is set pushes from the next step on, until a reset', (t) => {
  const lab = labOf(t, engine, CART)
  lab.inspect(true)
  lab.step(10)
  lab.actuate(0, 6)
  lab.step(100)
  const { ctrl, sensors, driven } = lab.panel.read()
  assert.deepEqual([...ctrl], [6, 0])
  assert.ok(Math.abs(sensors[0] - 0.2 * 3) < 1e-12, 'the speed is that of a force of 6 N on 2 kg for 0.2 s')
  assert.deepEqual([...driven], [0, 0])
  lab.reset()
  assert.deepEqual([...lab.panel.read().ctrl], [0, 0])
})

test('a goal does not count once an actuator was set, and counts again after a reset', (t) => {
  const goal = { goal: { hold: 0 } }
  const lab = labOf(t, engine, CART, goal, { goal: ({ data }) => data.qpos[0] > 1 })
  assert.ok(lab.goal.counts)
  lab.actuate(0, 8)
  assert.ok(!lab.goal.counts)
  lab.reset()
  assert.ok(lab.goal.counts)
  lab.startAt(0)
  assert.ok(!lab.goal.counts)
})

test('a keyframe begins a run without the setup; a reset goes back to the start of the lab', (t) => {
  const setup = ({ data }) => (data.qpos[0] = -1)
  const lab = labOf(t, engine, CART, {}, { setup })
  lab.step(20)
  lab.startAt(0)
  assert.deepEqual([lab.data.qpos[0], lab.time, lab.steps], [3, 0, 0])
  lab.reset()
  assert.equal(lab.data.qpos[0], -1)
})

test('code of a lab that sets an actuator wins, and the actuator is said to be driven', (t) => {
  const set = ({ data }, value) => (data.ctrl[1] = value)
  const controls = { controls: [control({ value: 0, min: 0, max: 1 })] }
  const named = labOf(t, engine, CART, controls, { controls: [{ set }] })
  named.inspect(true)
  assert.deepEqual([...named.panel.read().driven], [0, 1], 'its text names the element')
  const controller = ({ data }) => data.ctrl.fill(0.5)
  const lab = labOf(t, engine, CART, {}, { controller })
  lab.inspect(true)
  assert.deepEqual([...lab.panel.read().driven], [0, 0])
  lab.actuate(0, 7)
  lab.step(1)
  const { ctrl, driven } = lab.panel.read()
  assert.deepEqual([...ctrl], [0.5, 0.5])
  assert.deepEqual([...driven], [1, 1])
})

test('inspecting changes no bit of the motion', (t) => {
  const controller = ({ data }) => (data.ctrl[0] = Math.sin(9 * data.time) - data.sensordata[0])
  const labs = [labOf(t, engine, CART, {}, { controller }), labOf(t, engine, CART, {}, { controller })]
  labs[0].inspect(true)
  for (let i = 0; i < 200; i++) {
    labs.forEach((lab) => lab.step(1))
    labs[0].panel.read()
  }
  assert.deepEqual(labs[0].physics.read(), labs[1].physics.read())
})
