/**
 * The trial of labs without an engine, one classic script for a bare V8 in the process that builds the site.
 *
 *   tryCurves(requestJson) → replyJson    `config` of the lab, and `attempts`, each with `values` of its controls and the `claims` to
 *                                         evaluate, `[value, at]`; the reply has what follows from each
 */

import { Curves } from './lab/core/curves.js'
import { link } from './lab/core/program.js'

globalThis.tryCurves = (json) => {
  const { config, attempts } = JSON.parse(json)
  const curves = new Curves(config)
  const replies = attempts.map(({ values, claims }) => {
    const run = curves.run(values)
    const { held, ...samples } = run.samples()
    return {
      ...samples,
      longest: Math.max(0, ...held),
      readouts: run.readouts(config.states.length > 0 ? run.end : config.axis.at),
      end: run.end,
      failure: run.failure,
      events: run.solution?.events ?? [],
      claims: claims.map(([value, at]) => (at > run.end ? NaN : link(value)(run.at(at)))),
    }
  })
  return JSON.stringify(replies)
}
