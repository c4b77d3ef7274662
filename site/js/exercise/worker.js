/**
 * Judges an attempt in a worker that the page has started for it, and ends if it takes too long.
 *
 * To the worker: judge {config, module, mjb, wasm}; the last three are absolute addresses. To the page:
 *
 *   judging                                the engine has started
 *   verdict {index, passed, seen, failure} of a trial, in their order (see judge.js)
 *   judged                                 it was the last one
 *   refused {message}                      nothing can be tried
 */

import { confine } from './attempt.js'
import { judge } from './judge.js'

/** @param {import('../lab/worker/host.js').Host} host @param {Record<string, any>} message */
export async function judgeHere(host, { config, module, mjb, wasm }) {
  const { post, fetchBytes, importModule } = host.services
  const tell = (type, rest = {}) => post({ type, ...rest }, [])
  try {
    const model = config.exercise.subject === 'model' ? null : fetchBytes(mjb)
    const [engine, code, bytes] = await Promise.all([host.start(wasm), importModule(module), model])
    confine()
    tell('judging')
    let index = 0
    for (const verdict of judge(engine, config, code, bytes)) tell('verdict', { index: index++, ...verdict })
    tell('judged')
  } catch (error) {
    tell('refused', { message: error.message ?? String(error) })
  }
}
