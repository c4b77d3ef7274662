/**
 * A kind of lab that no JSON can describe: two simulations of one model which start a tiny nudge apart, and the distance between
 * them on a logarithmic scale. Where neighbours part exponentially the curve is a straight line.
 *
 * The JSON of such a lab:
 *
 *   model     what both run
 *   key       the keyframe that both start from (index or name)
 *   nudge     the number that differs: {"entry": "qvel", "index": 0, "sizes": [1e-9, 1e-6, 1e-3]}; the first size is that at first
 *   seconds   how long it runs
 *   camera, height   as in a simlab
 *
 * The page imports this module for `mount`; the worker imports it too, for the functions that a simlab's code consists of.
 */

const NUMBERS = 16 // of the state that are compared: the first of qpos, then of qvel

// --- in the worker, for each of the twins

/** Both are kept in `ctx` and take effect with the reset that follows. */
export const controls = [{ set: ({ ctx }, value) => (ctx.place = value) }, { set: ({ ctx }, value) => (ctx.nudge = value) }]

/** After every reset: the nudge. */
export const setup = ({ data, ctx }) => {
  const [entry, index] = ctx.place.split(' ')
  data[entry][Number(index)] += ctx.nudge
}

export const readouts = []

/** The state, number by number: sampled on the same grid of steps in both, so that equal places hold equal times. */
export const plots = [
  Array.from(
    { length: NUMBERS },
    (_, i) =>
      ({ data }) =>
        data.qpos[i] ?? data.qvel[i - data.qpos.length] ?? 0,
  ),
]

// --- in the page

export function mount(element, config, api) {
  const { nudge, seconds = 20, height = 220 } = config
  const place = `${nudge.entry} ${nudge.index}`
  const log = [[], []] // samples of each twin that the other has not reached yet

  const twins = []
  const playing = () => twins.some((twin) => twin.state === 'playing')
  const both = (act) => twins.forEach(act)

  const transport = api.createTransport({
    play: () => (playing() ? both((twin) => twin.pause()) : both((twin) => twin.play())),
    step: () => both((twin) => twin.step()),
    reset: () => both((twin) => twin.reset()),
    speed: (factor) => both((twin) => twin.speed(factor)),
  })
  ;['A', 'B'].forEach((name, which) => {
    const twin = api.createSimulation({
      key: config.key ?? null,
      camera: config.camera ?? null,
      height,
      label: `Twin ${name}`,
      stopAt: seconds,
      controls: [
        { type: 'select', label: 'nudged', param: 'place', options: [[place, place]], value: place },
        { type: 'slider', label: 'nudge', param: 'nudge', value: which === 0 ? 0 : nudge.sizes[0], reset: true },
      ],
      plots: [{ window: seconds, traces: Array.from({ length: NUMBERS }, (_, i) => ({ label: String(i) })) }],
      on: {
        samples: (samples, fresh) => collect(which, samples, fresh),
        refresh: ({ time }) => which === 0 && show(time),
        state: () => transport.setPlaying(playing()),
      },
    })
    twins.push(twin)
  })
  const settings = api.createControls(
    [{ type: 'select', label: 'nudge', options: nudge.sizes.map((size) => [api.formatLabel(size), size]) }],
    { set: (_, value) => twins.forEach((twin, which) => twin.set(1, which === 0 ? 0 : value)) }, // which resets both
  )
  settings.show([nudge.sizes[0]])
  const plot = api.createPlot({
    ylabel: 'distance',
    xlabel: 'time (s)',
    window: seconds,
    log: true,
    traces: [{ label: '|A − B|' }],
  })

  element.append(
    api.h('div', { class: 'lab-pair' }, ...twins.map((twin) => twin.element)),
    transport.element,
    settings.element,
    plot.element,
  )

  function collect(which, { times, values }, fresh) {
    if (fresh) {
      log.forEach((queue) => queue.splice(0))
      plot.clear()
    }
    times.forEach((time, i) => log[which].push({ time, state: values.subarray(i * NUMBERS, (i + 1) * NUMBERS) }))
    while (log[0].length > 0 && log[1].length > 0) compare(log[0][0], log[1][0])
  }

  function compare(a, b) {
    // After a reset one of the twins may still send a sample of the run before.
    if (a.time !== b.time) return void log[a.time < b.time ? 0 : 1].shift()
    log.forEach((queue) => queue.shift())
    const distance = Math.hypot(...a.state.map((x, i) => x - b.state[i]))
    if (distance > 0) plot.push([a.time], [distance], 1, 0)
  }

  function show(time) {
    transport.setTime(time)
    plot.draw()
  }
}
