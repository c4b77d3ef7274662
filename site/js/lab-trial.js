/**
 * The labs' trial, one classic script for a bare V8 in the process that builds the site.
 * docs/explanation/how-labs-run.md says how it is called:
 *
 *   reserve(name, size) → ArrayBuffer    to be filled from outside: 'wasm', and 'mjb' before each trial
 *   buffer(name)        → ArrayBuffer    one of those, or 'beats': a number that a trial increments whenever it makes progress
 *   boot('')            → ''             compiles and starts the engine; ends before the next call
 *   booted('')          → version        or throws why it did not start
 *   trial(requestJson)  → replyJson      lab/trial/trial.js; `mjb` of the request, a model in base64, goes before the buffer
 *   judge(requestJson)  → replyJson      an attempt at an exercise (exercise/judge.js): `{refused, verdicts}` of `{config, code, plays}`,
 *                                        and with `plays` what `played` of lab/trial/motion.js says
 *   lookUp(pathsJson)   → JSON           which of `data.qpos` and the like exist, with the model in 'mjb'
 *   trying('')          → JSON           for a trial that was stopped from outside: `stuck`, the entry whose code may never return, or
 *                                        `null`, and `trying`, the entry that was tried
 */

import './lab/trial/shims.js'
import loadMujoco from '@mujoco/mujoco'
import { attemptCode } from './exercise/attempt.js'
import { judge } from './exercise/judge.js'
import { createEngine } from './lab/core/engine.js'
import { Lab } from './lab/core/lab.js'
import { current } from './lab/core/piece.js'
import { Guard } from './lab/trial/guard.js'
import { played } from './lab/trial/motion.js'
import { lookUp } from './lab/trial/names.js'
import { runTrial, stuckEntry } from './lab/trial/trial.js'

const buffers = new Map()
const output = []
let engine = null
let guard = null
let failure = 'the engine has not been started'
const beats = new Uint32Array(1) // incremented as a trial makes progress, for the process outside to read
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
  createEngine(loadMujoco, module, (text) => output.push(text)).then(
    (instance) => {
      engine = instance
      guard = new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
    },
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
  const bytes = request.mjb === undefined ? new Uint8Array(buffers.get('mjb')) : /** @type {any} */ (Uint8Array).fromBase64(request.mjb)
  output.length = 0
  const now = () => {
    beats[0]++
    return performance.now()
  }
  const reply = runTrial(engine, request, bytes, now, guard)
  return JSON.stringify({ ...reply, printed: output.slice(0, 100) })
}

globalThis.judge = (json) => {
  const { config, code, plays } = JSON.parse(json)
  const bytes = new Uint8Array(buffers.get('mjb'))
  const verdicts = []
  let [refused, seen] = ['', {}]
  try {
    const functions = new Function(`"use strict"; return ${code}`)()
    for (const verdict of judge(engine, config, functions, bytes, guard, () => beats[0]++)) verdicts.push(verdict)
    if (plays) seen = played(() => new Lab(engine, config.exercise.subject === 'model' ? config.attempt : bytes, config, attemptCode(config, functions)))
  } catch (error) {
    refused = error.message ?? String(error)
  }
  guard.repair()
  return JSON.stringify({ refused, verdicts: refused === '' ? verdicts : [], ...seen })
}

globalThis.lookUp = (json) => JSON.stringify(lookUp(engine, new Uint8Array(buffers.get('mjb')), JSON.parse(json)))

globalThis.trying = () => JSON.stringify({ stuck: stuckEntry(performance.now()), trying: current.trying ?? [] })
