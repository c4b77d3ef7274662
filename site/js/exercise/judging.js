/** Has an attempt judged in a worker of its own, which ends with the last verdict, or when it takes too long. */

const STARTING = 60_000 // ms for the engine to arrive and start
const PATIENCE = 10_000 // ms for one trial

/**
 * @param {{worker: string, module: string, mjb: string, wasm: string}} addresses absolute
 * @param {Record<string, any>} config the lab's data, with `exercise` and `attempt`
 * @param {{begun: () => void, verdict: (index: number, verdict: Record<string, any>) => void, end: (problem: string | null) => void}} on
 *   `end`: after all verdicts; else with what is wrong, which is empty if it took too long
 * @returns {() => void} ends it without a word
 */
export function judgeAttempt({ worker: address, module, mjb, wasm }, config, on) {
  const worker = new Worker(address, { type: 'module', name: 'exercise' })
  let timer = 0
  const stop = () => {
    clearTimeout(timer)
    worker.terminate()
  }
  const end = (problem) => {
    stop()
    on.end(problem)
  }
  const wait = (ms) => {
    clearTimeout(timer)
    timer = setTimeout(() => end(''), ms)
  }
  worker.onmessage = ({ data: { type, index, message, ...verdict } }) => {
    if (type === 'judged') return end(null)
    if (type === 'refused') return end(message)
    wait(PATIENCE)
    if (type === 'verdict') on.verdict(index, verdict)
    else if (type === 'judging') on.begun()
  }
  worker.onerror = (event) => {
    event.preventDefault?.()
    end(event.message ?? 'the worker does not start')
  }
  wait(STARTING)
  worker.postMessage({ type: 'judge', config, module, mjb, wasm })
  return stop
}
