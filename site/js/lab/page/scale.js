/** A scale bar in the corner of a view: a round length at the distance of the camera's target. */

import { h, outline } from './dom.js'
import { roundLength } from './studio.js'

const MOST = 0.2 // of the view's width, for the bar
const MARGIN = 10 // CSS pixels
const TICK = 5

export class ScaleBar {
  /** @param {(key: string, values?: Record<string, any>) => string} words */
  constructor(words) {
    this.words = words
    this.svg = outline('')
    this.length = h('span')
    this.element = h('p', { class: 'lab-scale', role: 'img' }, this.svg, this.length)
  }

  /** Fit the bar to a view of `width` by `height` CSS pixels, of which a metre has `metre`. */
  show(width, height, metre) {
    const length = roundLength((MOST * width) / metre)
    const path = `M${MARGIN} ${height - MARGIN - TICK}v${TICK}h${(length * metre).toFixed(1)}v${-TICK}`
    if (path === this.path) return
    this.path = path
    this.svg.setAttribute('viewBox', `0 0 ${width} ${height}`)
    this.svg.firstElementChild.setAttribute('d', path)
    const text = `${Number(length.toPrecision(1))} m`
    if (text === this.length.textContent) return
    this.length.textContent = text
    this.element.setAttribute('aria-label', this.words('lab.scale', { length: text }))
  }
}
