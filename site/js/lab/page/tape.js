/** The row under Play: a step back, the run as a bar on which to go to another time, a step on. */

import { h, iconButton } from './dom.js'
import { formatTime } from './numbers.js'

const USUAL = 10 // s, for which there is room at first
const MANY = 20 // steps by an arrow key with Shift

/**
 * @param {(key: string, values?: Record<string, any>) => string} words
 * @param {number | null} stopAt s, where the run ends
 * @param {{seek: (time: number) => void, step: (count: number) => void}} actions
 */
export function buildTape(words, stopAt, { seek, step }) {
  const field = h('input', { type: 'range', class: 'lab-scrub', min: '0', max: String(stopAt ?? USUAL), step: 'any', value: '0' })
  field.setAttribute('aria-label', words('lab.live.tape'))
  const back = iconButton('back', words('lab.live.back'), () => step(-1))
  const on = iconButton('step', words('lab.live.step'), () => step(1))
  let queued = false
  field.addEventListener('input', () => {
    if (queued) return
    queued = true // at most one message per refresh of the screen
    requestAnimationFrame(() => {
      queued = false
      seek(Number(field.value))
    })
  })
  field.addEventListener('keydown', (event) => {
    const direction = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key]
    if (direction === undefined) return
    event.preventDefault()
    step(event.shiftKey ? MANY * direction : direction)
  })
  back.disabled = field.disabled = true
  return {
    element: h('div', { class: 'lab-tape' }, back, field, on),
    /** @param {{start: number, end: number}} range of the run @param {number} time where it stands (s) */
    show({ start, end }, time) {
      const first = end > start ? start : 0 // a run that is not kept has its time shown, and cannot be gone through
      field.min = String(first)
      field.max = String(Math.max(stopAt ?? first + USUAL, end))
      if (!queued) field.value = String(time)
      field.setAttribute('aria-valuetext', `${formatTime(time)} s`)
      field.disabled = end <= start
      back.disabled = time <= start
    },
    setEnabled(isEnabled) {
      on.disabled = !isEnabled
      if (!isEnabled) back.disabled = field.disabled = true
    },
  }
}
