/** The rows under the picture: play and pause, a step, reset, speed, time, full screen; and the run as a bar. */

import { h, icon, iconButton, onInput } from './dom.js'
import { formatLabel, formatRough, formatTime } from './numbers.js'

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5]
const ON_TIME = 0.95
const USUAL = 10 // s, for which there is room at first
const NEAR = 1e-9 // s, of an event
const MANY = 20 // steps by an arrow key with Shift

/**
 * @param {(key: string, values?: Record<string, any>) => string} words
 * @param {{play: () => void, step: (() => void) | null, reset: () => void, speed: (factor: number) => void, full: (() => void) | null}} actions
 */
export function buildTransport(words, actions) {
  const texts = ['play', 'pause'].map((key) => words(`lab.live.${key}`))
  const label = h('span', { 'data-room': texts.join('\n') }, texts[0]) // as wide as each of its texts
  const sign = h('span', { class: 'lab-sign' }, icon('play'))
  const play = h('button', { type: 'button', class: 'lab-play', onclick: actions.play }, sign, label)
  const step = actions.step === null ? null : iconButton('step', words('lab.live.step'), actions.step)
  const reset = iconButton('reset', words('lab.live.reset'), actions.reset)
  const speed = h('select', { class: 'lab-speed', 'aria-label': words('lab.live.speed'), title: words('lab.live.speed') })
  speed.append(...SPEEDS.map((factor) => h('option', { value: String(factor), selected: factor === 1 }, `${formatLabel(factor)} ×`)))
  speed.addEventListener('change', () => actions.speed(Number(speed.value)))
  const full = actions.full === null ? null : iconButton('full', words('lab.live.full'), actions.full)
  const time = h('output', { class: 'lab-time' })
  const late = h('span', { class: 'lab-late' })
  const clock = h('span', { class: 'lab-clock' }, time, late)
  const element = h(
    'div',
    { class: 'lab-transport', role: 'group', 'aria-label': words('lab.live.transport') },
    play,
    step,
    reset,
    speed,
    clock,
  )
  let shown = null
  return {
    element,
    full,
    speed,
    /** `text`: what pressing does while nothing moves, if it is more than to play. */
    setPlaying(isPlaying, text = texts[0]) {
      const next = isPlaying ? texts[1] : text
      if (next === shown) return
      shown = label.textContent = next
      if (!label.dataset.room.includes(next)) label.dataset.room += `\n${next}`
      sign.replaceChildren(icon(isPlaying ? 'pause' : 'play'))
    },
    setTime(seconds, digits = 2) {
      this.setText(`${formatTime(seconds, digits)} s`)
    },
    setText(text) {
      if (time.textContent !== text) time.textContent = text
    },
    /** @param {number} ratio of simulated to real time @param {number} [rate] pictures a second, if they are too few */
    setRatio(ratio, rate = Infinity) {
      const said = rate < Infinity ? words('lab.live.rate', { n: Math.round(rate) }) : ''
      const text = ratio < ON_TIME ? words('lab.live.ratio', { ratio: formatRough(ratio) }) : said
      if (late.textContent !== text) late.textContent = text
    },
    setEnabled(isEnabled) {
      for (const field of [step, reset, speed]) if (field !== null) field.disabled = !isEnabled
    },
  }
}

/**
 * The row under Play: the event before, a step back, the run as a bar on which to go to another time, a step on, the next event.
 *
 * @param {(key: string, values?: Record<string, any>) => string} words
 * @param {number | null} stopAt s, where the run ends
 * @param {{seek: (time: number) => void, step: (count: number) => void}} actions
 */
export function buildTape(words, stopAt, { seek, step }) {
  const field = h('input', { type: 'range', class: 'lab-scrub', min: '0', max: String(stopAt ?? USUAL), step: 'any', value: '0' })
  field.setAttribute('aria-label', words('lab.live.tape'))
  const back = iconButton('back', words('lab.live.back'), () => step(-1))
  const on = iconButton('step', words('lab.live.step'), () => step(1))
  let [earlier, later] = [0, 0] // times of the events before and after
  const previous = iconButton('previous', words('lab.live.previous_event'), () => seek(earlier))
  const next = iconButton('next', words('lab.live.next_event'), () => seek(later))
  const isQueued = onInput(field, () => seek(Number(field.value)))
  field.addEventListener('keydown', (event) => {
    const jump = { PageDown: previous, PageUp: next }[event.key]
    if (jump) event.preventDefault()
    jump?.click()
    const direction = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key]
    if (direction === undefined) return
    event.preventDefault()
    step(event.shiftKey ? MANY * direction : direction)
  })
  const inRun = [previous, back, field, next]
  for (const part of inRun) part.disabled = true
  return {
    element: h('div', { class: 'lab-tape' }, previous, back, field, on, next),
    /** @param {{start: number, end: number}} range of the run @param {number} time where it stands (s) @param {{time: number, label: string}[]} events */
    show({ start, end }, time, events) {
      const first = end > start ? start : 0 // a run that is not kept has its time shown, and cannot be gone through
      field.min = String(first)
      field.max = String(Math.max(stopAt ?? first + USUAL, end))
      if (!isQueued()) field.value = String(time)
      const labels = events.filter((event) => Math.abs(event.time - time) < NEAR).map(({ label }) => label)
      field.setAttribute('aria-valuetext', [`${formatTime(time)} s`, ...labels].join(', '))
      const times = [start, ...events.map((event) => event.time), end]
      earlier = Math.max(...times.filter((at) => at < time - NEAR))
      later = Math.min(...times.filter((at) => at > time + NEAR))
      field.disabled = end <= start
      back.disabled = time <= start
      previous.disabled = earlier < start
      next.disabled = later > end
    },
    setEnabled(isEnabled) {
      on.disabled = !isEnabled
      if (!isEnabled) for (const part of inRun) part.disabled = true
    },
  }
}
