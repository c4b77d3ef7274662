/** What lab code sees: `{model, data, mj, sim, ctx, lib}`. */

import { contactList, createLib } from './lib.js'

/**
 * @param {import('./lab.js').Lab} lab
 * @param {Record<string, any>} data the MjData that the code sees
 * @param {boolean} acts whether the code may act; what only looks may not
 */
export function environment(lab, data, acts) {
  const { engine, model, ctx, scratch } = lab
  const act = (name, action) =>
    acts
      ? action
      : () => {
          throw new Error(`${name}() is not for code that only looks`)
        }
  const random = act('lib.random', () => lab.draw())
  const sim = Object.freeze({
    get time() {
      return data.time
    },
    get paused() {
      return lab.paused
    },
    play: act('sim.play', () => lab.setPaused(false)),
    pause: act('sim.pause', () => lab.setPaused(true)),
    reset: act('sim.reset', () => lab.reset()),
    step: act('sim.step', (n = 1) => void lab.step(n)),
    contacts: () => contactList(engine, model, data, scratch),
  })
  return Object.freeze({ model, data, mj: engine.mj, sim, ctx, lib: createLib(engine, model, data, scratch, random) })
}
