/**
 * What a reader has written, put in the place of the author's solution: the model, the controller, or the function `ctx.answer`.
 *
 * `config.exercise` is what coursebuild/features/exercise/model.py says of the exercise, `config.attempt` the text.
 */

import { formulaCode } from './formula.js'

/**
 * The code of a lab with an attempt in it; that of a model is not in the code.
 *
 * @param {Record<string, any>} config
 * @param {Record<string, any>} code of the lab
 * @throws {SyntaxError} the text is no JavaScript, or no formula
 */
export function attemptCode({ exercise, attempt }, code) {
  if (exercise.subject === 'model') return code
  const run = compile(exercise, attempt)
  if (exercise.subject === 'controller') return { ...code, controller: run }
  const setup = (env) => {
    env.ctx.answer = run
    code.setup(env)
  }
  return { ...code, setup }
}

/** The same for a reader who watches: a readout that fails shows nothing, as the attempt may lack what it reads. */
export function watchableCode(config, code) {
  const readouts = code.readouts.map((read) => (env) => {
    try {
      return read(env) ?? null
    } catch {
      return null
    }
  })
  return { ...attemptCode(config, code), readouts }
}

function compile(exercise, attempt) {
  if (exercise.subject === 'formula') return new Function(...exercise.names, `return ${formulaCode(attempt, exercise)}`)
  const [before, after] = exercise.bounds
  new Function(attempt) // as it stands alone: a text that closes its function and opens another is refused
  return new Function(`"use strict"; return (${before}${attempt}${after})`)()
}

const REACH = [
  'fetch', 'XMLHttpRequest', 'WebSocket', 'WebSocketStream', 'WebTransport', 'EventSource', 'importScripts', 'Worker', 'SharedWorker', 'BroadcastChannel',
  'indexedDB', 'caches', 'cookieStore', 'navigator', 'Notification', 'postMessage', 'close',
] // prettier-ignore

/**
 * Take from this worker, for good, all by which its code could reach the network, what a browser keeps, or other pages, and by which it
 * could speak to the page in the place of its judge. Sizes of the model and its data can be read only: with another one the engine would
 * leave its arrays, and end the page.
 *
 * @param {Record<string, any>} mj the engine's bindings
 */
export function confine(mj) {
  for (const { prototype } of [mj.MjModel, mj.MjData]) {
    for (const [name, property] of Object.entries(Object.getOwnPropertyDescriptors(prototype))) {
      if (property.set && /^[np]/.test(name)) Object.defineProperty(prototype, name, { ...property, set: undefined }) // `nv`, `pstack`
    }
  }
  // What a text begins and nobody awaits, such as an import, fails silently: at each step, the page would be told again.
  globalThis.addEventListener?.('unhandledrejection', (event) => event.preventDefault())
  for (let owner = globalThis; owner !== null; owner = Object.getPrototypeOf(owner)) {
    for (const name of REACH) Reflect.deleteProperty(owner, name)
  }
}
