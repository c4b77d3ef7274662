/**
 * The labs' trial, one classic script for a bare V8 in the process that builds the site.
 * docs/explanation/how-labs-run.md says how it is called:
 *
 *   reserve(name, size) → ArrayBuffer    to be filled from outside: 'wasm', and 'mjb' before each trial
 *   buffer(name)        → ArrayBuffer    one of those, or 'beats': a number that a trial counts up whenever it gets on
 *   boot('')            → ''             compiles and starts the engine; ends before the next call
 *   booted('')          → version        or throws why it did not start
 *   trial(requestJson)  → replyJson
 *   lookUp(pathsJson)   → JSON           what of `data.qpos` and the like exists, with the model in 'mjb'
 *   trying('')          → JSON           for a trial that was stopped from outside: `stuck`, the entry whose code may never return, or
 *                                        `null`, and `trying`, the entry that was tried
 */

import './lab/trial/shims.js'
import loadMujoco from '@mujoco/mujoco'
import { createEngine } from './lab/core/engine.js'
import { current } from './lab/core/piece.js'
import { fromBase64 } from './lab/trial/base64.js'
import { Guard } from './lab/trial/guard.js'
import { lookUp } from './lab/trial/names.js'
import { runTrial, stuck } from './lab/trial/trial.js'

const buffers = new Map()
const printed = []
let engine = null
let guard = null
let failure = 'the engine has not been started'
const beats = new Uint32Array(1) // counted up whenever a trial gets on, for those who look from outside while it runs
buffers.set('beats', beats.buffer)

globalThis.setTimeout = () => {
  throw new Error('a lab sets no timers: they would ring in the next one')
}

globalThis.reserve = (name, size) => {
  const buffer = new ArrayBuffer(size)
  buffers.set(name, buffer)
  return buffer
}

globalThis.buffer = (name) => buffers.get(name)

globalThis.boot = () => {
  const module = new WebAssembly.Module(buffers.get('wasm'))
  buffers.delete('wasm')
  createEngine(loadMujoco, module, (text) => printed.push(text)).then(
    (started) => (engine = started),
    (error) => (failure = error.message),
  )
  return ''
}

globalThis.booted = () => {
  if (engine === null) throw new Error(failure)
  return engine.version
}

globalThis.trial = (json) => {
  const request = JSON.parse(json)
  const bytes = request.mjb === undefined ? new Uint8Array(buffers.get('mjb')) : fromBase64(request.mjb)
  printed.length = 0
  guard ??= new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
  const now = () => {
    beats[0]++
    return performance.now()
  }
  const reply = runTrial(engine, request, bytes, now, guard)
  return JSON.stringify({ ...reply, printed: printed.slice(0, 100) })
}

globalThis.lookUp = (json) => JSON.stringify(lookUp(engine, new Uint8Array(buffers.get('mjb')), JSON.parse(json)))

globalThis.trying = () => JSON.stringify({ stuck: stuck(performance.now()), trying: current.trying ?? [] })
