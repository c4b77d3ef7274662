/**
 * The labs' worker: physics, lab code and plots, away from the page's thread. lab/worker/session.js has the protocol.
 */

import loadMujoco from '@mujoco/mujoco'
import { confine } from './exercise/attempt.js'
import { judge } from './exercise/judge.js'
import { Guard } from './lab/trial/guard.js'
import { Host } from './lab/worker/host.js'
import { createLater } from './lab/worker/later.js'

const postMessage = self.postMessage.bind(self) // which `confine` takes away

const host = new Host({
  loadMujoco,
  post: (message, transfer) => postMessage(message, transfer),
  now: () => performance.now(),
  later: createLater(),
  importModule: (url) => import(url),
  async fetchBytes(url) {
    const response = await get(url)
    return new Uint8Array(await response.arrayBuffer())
  },
  async compile(url) {
    const response = await get(url)
    // Compiling while it arrives needs the right media type, which not every server sends.
    const streams = /^application\/wasm\b/.test(response.headers.get('Content-Type') ?? '')
    return streams ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer())
  },
})

async function get(url) {
  const response = await fetch(url)
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`)
  return response
}

/**
 * Judge an attempt in a worker that the page has started for it, which the page ends if it takes too long.
 *
 * To the worker: judge {lab, config, module, mjb, wasm}; the last three are absolute addresses. To the page:
 *
 *   judging                                the engine has started
 *   verdict {index, passed, seen, failure} of a trial, in their order (see judge.js)
 *   judged                                 it was the last one
 *   refused {message}                      nothing can be tried
 *
 * @param {Record<string, any>} message
 */
async function judgeHere({ lab, config, module, mjb, wasm }) {
  const { post, fetchBytes, importModule } = host.services
  const tell = (type, rest = {}) => post({ type, lab, ...rest }, [])
  try {
    const model = config.exercise.subject === 'model' ? null : fetchBytes(mjb)
    const [engine, code, bytes] = await Promise.all([host.start(wasm), importModule(module), model])
    confine(engine.mj)
    const guard = new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
    tell('judging')
    let index = 0
    for (const verdict of judge(engine, config, code, bytes, guard)) tell('verdict', { index: index++, ...verdict })
    tell('judged')
  } catch (error) {
    tell('refused', { message: error.message ?? String(error) })
  }
}

self.onmessage = ({ data }) => void (data.type === 'judge' ? judgeHere(data) : host.receive(data))
