/**
 * The worker that the page's labs share, and each lab's line to it. worker/session.js has the protocol.
 *
 *   const line = connection(workerUrl).open(id, receive)
 *   line.send({ type: 'play' }); line.close()
 *
 * With a `#` in its address a worker is dedicated: it ends with its lab, or when it does not answer for too long.
 */

const BEAT = 5000 // ms between two pings to a dedicated worker
const MISSED = 3 // pings that it may leave without an answer

const connections = new Map()

/** The connection to the worker at this address; one for the page. */
export function connection(url, start = startWorker) {
  if (!connections.has(url)) connections.set(url, new Connection(url, start))
  return connections.get(url)
}

const startWorker = (url) => new Worker(url, { type: 'module', name: 'labs' })

/**
 * Start a worker under the policy of the page, by which nothing in it reaches another host, `import()` included: a worker takes the
 * policy of who started it if its own script comes from no host.
 *
 * @param {string} url of the worker's script
 */
export function startConfined(url) {
  if (url.startsWith('data:')) return startWorker(url)
  const script = URL.createObjectURL(new Blob([`import ${JSON.stringify(url)}`], { type: 'text/javascript' }))
  const worker = startWorker(script)
  for (const type of ['message', 'error']) worker.addEventListener(type, () => URL.revokeObjectURL(script), { once: true })
  return worker
}

export class Connection {
  /** @param {string} url of the worker's script; @param {(url: string) => Worker} [start] */
  constructor(url, start = startWorker) {
    this.url = url
    this.start = start
    this.worker = null
    this.lines = new Map()
    this.isDedicated = url.includes('#')
  }

  /**
   * Open a lab's line.
   *
   * @param {string} id
   * @param {(message: Record<string, any>) => void} receive gets every message about this lab
   */
  open(id, receive) {
    if (this.lines.has(id)) throw new Error(`the lab ${id} is on the page twice`)
    if (this.worker === null) this.begin()
    this.lines.set(id, receive)
    return {
      send: (message, transfer = []) => this.worker?.postMessage({ ...message, lab: id }, transfer),
      close: () => {
        if (!this.lines.delete(id)) return
        if (this.isDedicated) this.end()
        else this.worker?.postMessage({ type: 'dispose', lab: id })
      },
    }
  }

  begin() {
    this.worker = this.start(this.url)
    this.silence = 0
    if (this.isDedicated) this.beat = setInterval(() => this.ask(), BEAT)
    this.worker.onmessage = ({ data }) => {
      this.silence = 0
      this.lines.get(data.lab)?.(data)
      if (data.type === 'error' && data.fatal) this.fail('the engine has ended', data.lab)
    }
    this.worker.onerror = (event) => {
      event.preventDefault?.() // it is told in the page
      this.fail(event.message ?? 'the worker does not start')
    }
    this.worker.onmessageerror = () => this.fail('a message of the worker cannot be read')
  }

  /** Check that the worker still answers. */
  ask() {
    if (this.silence === MISSED) this.fail('it takes too long, or too much memory', null, 'silent')
    this.silence += 1
    this.worker?.postMessage({ type: 'ping' })
  }

  end() {
    clearInterval(this.beat)
    this.worker?.terminate()
    this.worker = null
  }

  // The engine's memory is lost with the worker: every lab gets an error, and the next one starts a new worker.
  fail(message, notifiedId = null, kind = 'worker') {
    this.end()
    for (const [id, receive] of [...this.lines]) {
      if (id === notifiedId) continue
      receive({ type: 'error', message, entry: [], kind, fatal: true })
    }
  }
}
