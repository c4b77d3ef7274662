/** The row under the picture: play and pause, a step, reset, speed, time, full screen. */

import { h, icon, iconButton } from './dom.js'
import { formatRatio, formatTime } from './numbers.js'

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5]
const ON_TIME = 0.95

/**
 * @param {(key: string, values?: Record<string, any>) => string} words
 * @param {{play: () => void, step: (() => void) | null, reset: () => void, speed: (factor: number) => void, full: (() => void) | null}} actions
 */
export function buildTransport(words, actions) {
  const label = h('span', {}, words('lab.live.play'))
  const sign = h('span', { class: 'lab-sign' }, icon('play'))
  const play = h('button', { type: 'button', class: 'lab-play', onclick: actions.play }, sign, label)
  const step = actions.step === null ? null : iconButton('step', words('lab.live.step'), actions.step)
  const reset = iconButton('reset', words('lab.live.reset'), actions.reset)
  const speed = h('select', { class: 'lab-speed', 'aria-label': words('lab.live.speed'), title: words('lab.live.speed') })
  speed.append(...SPEEDS.map((factor) => h('option', { value: String(factor), selected: factor === 1 }, `${factor} ×`)))
  speed.addEventListener('change', () => actions.speed(Number(speed.value)))
  const full = actions.full === null ? null : iconButton('full', words('lab.live.full'), actions.full)
  const time = h('output', { class: 'lab-time' })
  const late = h('span', { class: 'lab-late' })
  const clock = h('span', { class: 'lab-clock' }, time, late)
  const element = h(
    'div',
    { class: 'lab-transport', role: 'group', 'aria-label': words('lab.live.transport') },
    ...[play, step, reset, speed, clock].filter((part) => part !== null),
  )
  let shown = null
  return {
    element,
    full,
    speed,
    /** `text`: what pressing does while nothing moves, if it is more than to play. */
    setPlaying(isPlaying, text = words('lab.live.play')) {
      const next = isPlaying ? words('lab.live.pause') : text
      if (next === shown) return
      shown = label.textContent = next
      sign.replaceChildren(icon(isPlaying ? 'pause' : 'play'))
    },
    setTime(seconds) {
      this.setText(`${formatTime(seconds)} s`)
    },
    setText(text) {
      if (time.textContent !== text) time.textContent = text
    },
    setRatio(ratio) {
      const text = ratio < ON_TIME ? words('lab.live.ratio', { ratio: formatRatio(ratio) }) : ''
      if (late.textContent !== text) late.textContent = text
    },
    setEnabled(isEnabled) {
      for (const field of [step, reset, speed]) if (field !== null) field.disabled = !isEnabled
    },
  }
}
