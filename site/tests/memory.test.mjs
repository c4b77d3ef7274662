/** A lab gives back all of the engine's memory that it took. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { EngineError } from '../js/lab/core/engine.js'
import { Lab } from '../js/lab/core/lab.js'
import { EVERYTHING } from './everything.mjs'
import { FALLING, code, compile, config, control, newEngine, plot } from './helpers.mjs'

/** Where the engine puts a large block: the end of what is in use, when nothing was left behind. */
function highWater({ mj }) {
  const block = new mj.DoubleBuffer(1 << 17)
  const address = block.GetPointer()
  block.delete()
  return address
}

function exercise(engine, bytes) {
  const lab = new Lab(
    engine,
    bytes,
    config({ overlays: ['frames', 'contacts'], plots: [plot(2)], controls: [control({ value: 1 }), control({ type: 'button' })] }),
    code({
      controls: [{ set: ({ data }, value) => (data.qvel[0] = value) }, { run: ({ sim }) => sim.reset() }],
      readouts: [({ lib }) => lib.energy().total, ({ sim }) => sim.contacts().length, ({ lib }) => lib.normalForce()],
      plots: [[({ lib }) => lib.norm(lib.angmom()), ({ data }) => data.time]],
    }),
  )
  lab.start()
  lab.perturb({ body: 1, point: [0, 0, 1], target: [0, 0, 2] })
  lab.step(20)
  lab.perturb(null)
  lab.readouts()
  lab.frame()
  lab.scene()
  lab.restore(lab.state())
  lab.press(1)
  lab.dispose()
  lab.dispose()
}

// The engine itself keeps 16 bytes when a model of the second kind is loaded and deleted, without a lab.
for (const [name, xml, times, kept] of [
  ['a small lab', FALLING, 200, 0],
  ['a lab with everything', EVERYTHING, 12, 16],
]) {
  test(`${name}, made and disposed of ${times} times`, async () => {
    const engine = await newEngine()
    const bytes = compile(engine, xml)
    for (let i = 0; i < times / 4; i++) exercise(engine, bytes)
    const before = highWater(engine)
    for (let i = 0; i < times; i++) exercise(engine, bytes)
    assert.ok(highWater(engine) - before <= kept * times, `${highWater(engine) - before} bytes`)
  })
}

test('a lab that cannot be made leaves nothing behind', async () => {
  const engine = await newEngine()
  const bytes = compile(engine, FALLING)
  const broken = () => {
    for (const spoilt of [bytes.slice(0, 3000), new Uint8Array(0), bytes.map((x, i) => (i === 5 ? x ^ 255 : x))]) {
      assert.throws(() => engine.load(spoilt), (error) => error instanceof EngineError && !error.fatal)
    }
  }
  const all = () => {
    assert.throws(() => new Lab(engine, bytes, config({ trail: 'nowhere' }), code()), RangeError)
    assert.throws(() => new Lab(engine, bytes, config({ key: 'none' }), code()), RangeError)
    broken()
  }
  for (let i = 0; i < 20; i++) all()
  const before = highWater(engine)
  for (let i = 0; i < 50; i++) all()
  assert.equal(highWater(engine), before)
})
