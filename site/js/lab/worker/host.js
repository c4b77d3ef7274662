/**
 * The labs of a page in one worker: they share one engine, and its time is divided among those that run.
 *
 * The worker's functions are handed in, so that the tests can run this module outside a worker.
 */

import { confine, watchableCode } from '../../exercise/attempt.js'
import { EngineError, createEngine } from '../core/engine.js'
import { Session } from './session.js'

const BUDGET = 12 // ms of stepping before messages are looked at
const LONGEST = 8 // ms between two ticks

/** The code of a lab that has none: of a model that the reader edits. It starts from the first keyframe, if any. */
const PLAIN = {
  setup: ({ model, data, mj }) => {
    if (model.nkey > 0) mj.mj_resetDataKeyframe(model, data, 0)
  },
  controls: [],
  readouts: [],
  plots: [],
}

export class Host {
  /**
   * @param {object} services
   * @param {(message: Record<string, any>, transfer: ArrayBuffer[]) => void} services.post
   * @param {() => number} services.now ms
   * @param {(action: () => void, ms: number) => unknown} services.later
   * @param {(url: string) => Promise<Uint8Array>} services.fetchBytes
   * @param {(url: string) => Promise<Record<string, any>>} services.importModule
   * @param {(url: string) => Promise<WebAssembly.Module>} services.compile
   * @param {(module: Record<string, any>) => Promise<Record<string, any>>} services.loadMujoco
   */
  constructor(services) {
    this.services = services
    this.sessions = new Map()
    this.queues = new Map()
    this.engine = null
    this.due = Infinity
  }

  /** Handle a message of the page. */
  receive(message) {
    if (message.type === 'load') return void this.load(message)
    const id = message.lab
    if (message.type === 'ping') return void this.services.post({ type: 'pong', lab: id }, [])
    if (message.type === 'dispose') {
      this.sessions.get(id)?.close()
      this.sessions.delete(id)
      this.queues.delete(id)
    } else if (this.queues.has(id)) {
      this.queues.get(id).push(message)
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
      const { loadMujoco, compile } = this.services
      this.engine = compile(wasm).then((module) => createEngine(loadMujoco, module))
      this.engine.catch(() => (this.engine = null)) // the network may be back for the next lab
    }
    return this.engine
  }

  async load({ lab: id, config, module, mjb, wasm, own }) {
    const { post, now, fetchBytes, importModule } = this.services
    this.sessions.get(id)?.close()
    const queue = []
    this.queues.set(id, queue)
    try {
      const model = config.xml ?? fetchBytes(mjb)
      const [engine, source, code] = await Promise.all([this.start(wasm), model, module === '' ? PLAIN : importModule(module)])
      if (this.queues.get(id) !== queue) return // disposed of, or loaded again
      const session = new Session(id, post, now)
      this.sessions.set(id, session)
      if (config.attempt !== undefined) confine(engine.mj) // its worker is dedicated
      session.open(engine, source, config, config.attempt === undefined ? code : watchableCode(config, code), own)
      this.queues.delete(id)
      queue.forEach((message) => session.receive(message))
      session.show()
      this.wake()
    } catch (error) {
      if (this.queues.get(id) === queue) this.queues.delete(id)
      const fatal = error instanceof EngineError && error.fatal
      post({ type: 'error', lab: id, message: `the lab does not load: ${error.message}`, entry: [], kind: 'load', fatal }, [])
    }
  }

  /** Plan a tick if a lab runs and none is planned. */
  wake() {
    const busy = [...this.sessions.values()].some((session) => session.busy)
    if (busy && this.due === Infinity) this.plan(0)
  }

  plan(ms) {
    this.due = this.services.now() + ms
    this.services.later(() => this.tick(), ms)
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
