/**
 * The labs of a page in one worker: one engine, its time shared out among those that run.
 *
 * Pure of the worker's surroundings, which are handed in: so the tests run it as it is.
 */

import { EngineError, createEngine } from '../core/engine.js'
import { Session } from './session.js'

const BUDGET = 12 // ms of stepping before messages are looked at
const LONGEST = 8 // ms between two looks at what is due

export class Host {
  /**
   * @param {object} around
   * @param {(message: object, transfer: ArrayBuffer[]) => void} around.post
   * @param {() => number} around.now ms
   * @param {(action: () => void, ms: number) => unknown} around.later
   * @param {(url: string) => Promise<Uint8Array>} around.fetchBytes
   * @param {(url: string) => Promise<object>} around.importModule
   * @param {(url: string) => Promise<WebAssembly.Module>} around.compile
   * @param {(module: object) => Promise<object>} around.loadMujoco
   */
  constructor(around) {
    this.around = around
    this.sessions = new Map()
    this.waiting = new Map()
    this.engine = null
    this.due = Infinity
  }

  /** Handle a message of the page. */
  receive(message) {
    if (message.type === 'warm') return void this.start(message.wasm).catch(() => {}) // a lab that needs it will tell
    if (message.type === 'load') return void this.load(message)
    const id = message.lab
    if (message.type === 'ping') return void this.around.post({ type: 'pong', lab: id }, [])
    if (message.type === 'dispose') {
      this.sessions.get(id)?.close()
      this.sessions.delete(id)
      this.waiting.delete(id)
    } else if (this.waiting.has(id)) {
      this.waiting.get(id).push(message)
    } else if (this.sessions.has(id)) {
      const session = this.sessions.get(id)
      session.receive(message)
      session.show()
      this.wake()
    }
  }

  /** Start the engine, once. */
  start(wasm) {
    if (this.engine === null) {
      const { loadMujoco, compile } = this.around
      this.engine = compile(wasm).then((module) => createEngine(loadMujoco, module))
      this.engine.catch(() => (this.engine = null)) // the network may be back for the next lab
    }
    return this.engine
  }

  async load({ lab: id, config, module, mjb, wasm }) {
    const { post, now, fetchBytes, importModule } = this.around
    this.sessions.get(id)?.close()
    const queue = []
    this.waiting.set(id, queue)
    try {
      const model = config.xml ?? fetchBytes(mjb)
      const [engine, source, code] = await Promise.all([this.start(wasm), model, importModule(module)])
      if (this.waiting.get(id) !== queue) return // disposed of, or loaded again
      const session = new Session(id, post, now)
      this.sessions.set(id, session)
      session.open(engine, source, config, code)
      this.waiting.delete(id)
      queue.forEach((message) => session.receive(message))
      session.show()
      this.wake()
    } catch (error) {
      if (this.waiting.get(id) === queue) this.waiting.delete(id)
      const fatal = error instanceof EngineError && error.fatal
      post({ type: 'error', lab: id, message: `the lab does not load: ${error.message}`, entry: [], kind: 'load', fatal }, [])
    }
  }

  /** See to it that running labs are looked after soon. */
  wake() {
    const busy = [...this.sessions.values()].some((session) => session.busy)
    if (busy && this.due === Infinity) this.plan(0)
  }

  plan(ms) {
    this.due = this.around.now() + ms
    this.around.later(() => this.tick(), ms)
  }

  tick() {
    this.due = Infinity
    const busy = [...this.sessions.values()].filter((session) => session.busy)
    if (busy.length === 0) return
    let wait = LONGEST
    for (const session of busy) {
      wait = Math.min(wait, session.run(BUDGET / busy.length))
      session.show()
    }
    this.plan(wait)
  }
}
