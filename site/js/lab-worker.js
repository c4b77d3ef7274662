/**
 * The labs' worker: physics, lab code and plots, away from the page's thread. lab/worker/session.js has the protocol.
 */

import loadMujoco from '@mujoco/mujoco'
import { judgeHere } from './exercise/worker.js'
import { Host } from './lab/worker/host.js'
import { createLater } from './lab/worker/later.js'

const host = new Host({
  loadMujoco,
  post: (message, transfer) => self.postMessage(message, transfer),
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

self.onmessage = ({ data }) => void (data.type === 'judge' ? judgeHere(host, data) : host.receive(data))
