/**
 * What a lab's tape costs: steps a second beside the engine alone, and memory after long runs.
 *
 * Run from the root: node --expose-gc benchmarks/tape.mjs [ROUNDS]
 *
 * The models take turns in short runs from the start, where the tape keeps most: the engine's own step in a loop (bare V8), a lab with a
 * plot, and the same lab with a tape. Processor time is counted, since other work on the machine does not lengthen it much. Memory is
 * what the heap and its arrays hold beyond the same lab without a tape, after collection.
 */

import { readFileSync } from 'node:fs'
import { Lab } from '../site/js/lab/core/lab.js'
import { Tape } from '../site/js/lab/core/tape.js'
import { code, compile, config, newEngine, plot } from '../site/tests/helpers.mjs'

const STEPS = 5000
const LONG = 300_000 // steps
const MODELS = ['pendulum', 'two_links', 'tumbling_box', 'gripper']
const rounds = Number(process.argv[2] ?? 41)

const engine = await newEngine()
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1]
const processorTime = () => {
  const { user, system } = process.cpuUsage()
  return (user + system) / 1e6 // s
}

/** A lab of a model with a plot of a height; `fill` makes what it keeps of its own. */
function makeLab(bytes, isTaped, fill = () => {}) {
  const lab = new Lab(engine, bytes, config({ plots: [plot(1, { window: 10 })] }), code({ setup: ({ ctx }) => fill(ctx), plots: [[({ lib }) => lib.bodyPos(1)[2]]] }))
  if (isTaped) lab.tape = new Tape(lab)
  lab.start()
  return lab
}

function stepsPerSecond(step) {
  const start = processorTime()
  step()
  return STEPS / (processorTime() - start)
}

function race(bytes) {
  const labs = [makeLab(bytes, false), makeLab(bytes, true)]
  const { model, data } = makeLab(bytes, false)
  const runners = [
    () => {
      engine.mj.mj_resetData(model, data)
      return stepsPerSecond(() => {
        for (let i = 0; i < STEPS; i++) engine.mj.mj_step(model, data)
      })
    },
    ...labs.map((lab) => () => {
      lab.reset()
      lab.sampler.take()
      return stepsPerSecond(() => {
        for (let i = 0; i < STEPS; i += 250) lab.step(250)
      })
    }),
  ]
  const speeds = runners.map((run) => [run()].slice(1)) // once to be warm
  for (let round = 0; round < rounds; round++) {
    for (let i = 0; i < runners.length; i++) {
      const turn = (round + i) % runners.length
      speeds[turn].push(runners[turn]())
    }
  }
  return speeds
}

/** MB that a tape holds after a long run. */
function memoryOf(bytes, fill) {
  const held = () => {
    globalThis.gc()
    const { heapUsed, arrayBuffers } = process.memoryUsage()
    return (heapUsed + arrayBuffers) / 1e6
  }
  const lab = makeLab(bytes, true, fill)
  for (let i = 0; i < LONG; i += 1000) {
    lab.step(1000)
    lab.sampler.take()
  }
  const before = held()
  lab.tape = null
  const size = before - held()
  lab.dispose()
  return size
}

console.log(`steps a second of processor time: bare V8, lab, lab with tape (x: bare V8 over it, median of ${rounds} rounds); MB of the tape`)
for (const name of MODELS) {
  const bytes = compile(engine, readFileSync(new URL(`../models/${name}.xml`, import.meta.url), 'utf8'))
  const speeds = race(bytes)
  const [, plain, taped] = speeds.map((list) => median(list.map((speed, i) => speeds[0][i] / speed)).toFixed(2))
  const [bare, lab, whole] = speeds.map((list) => Math.round(median(list)).toLocaleString('en'))
  const memory = [() => {}, (ctx) => (ctx.ring = new Float64Array(4900)), (ctx) => (ctx.list = Array.from({ length: 1600 }, (_, i) => ({ i, at: i / 7 })))]
  const sizes = memory.map((fill) => memoryOf(bytes, fill).toFixed(1)).join(', ')
  console.log(`${name.padEnd(16)} ${bare}, ${lab} (x ${plain}), ${whole} (x ${taped}); ${sizes} with nothing, 4900 numbers, 1600 objects in ctx`)
}
