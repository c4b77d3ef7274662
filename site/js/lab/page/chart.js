/**
 * A plot of whole curves as SVG, for labs without an engine: axes, lines with their names at the ends, arrows of a phase plane, and the
 * point to which the reader has come. Style sheets colour it, as they do the plots of the static form.
 */

import { draw, h } from './dom.js'
import { formatLabel } from './numbers.js'
import { spanOf, spread } from './span.js'

const DASHES = ['', '6 3', '2 3', '8 3 2 3', '1 4']
const LETTER = 7 // px, of a letter or a digit
const TOP = 24
const BOTTOM = 38
const GAP = 13 // between names
const ARROWS = [17, 11] // of a field, across and up
const COLOURS = 6

export class Chart {
  /**
   * @param {Record<string, any>} plot of the lab's JSON
   * @param {{axis: Record<string, any>, caption: string, height: number, seek: (x: number) => void,
   *   direction: (point: [number, number]) => number[]}} options `seek`: the reader points at a place of the axis
   */
  constructor(plot, { axis, caption, height, seek, direction }) {
    this.plot = plot
    this.axis = axis
    this.direction = direction
    this.svg = draw('svg', { role: 'img', 'aria-label': `${caption}: ${plot.traces.map(({ label }) => label).join(', ')}` })
    this.frame = draw('g')
    this.field = draw('path', { class: 'lab-field' })
    this.ghosts = plot.traces.map((_, i) => draw('path', { class: `lab-ghost ${colour('lab-trace', i)}` }))
    this.lines = plot.traces.map((trace, i) =>
      draw('path', { class: `lab-trace ${colour('lab-trace', i)}`, 'stroke-dasharray': dashOf(trace, i) }),
    )
    this.marks = draw('g', { class: 'lab-measured' })
    this.cursor = draw('path', { class: 'lab-cursor' })
    this.points = plot.traces.map((_, i) => draw('circle', { class: `lab-point ${colour('lab-trace', i)}`, r: '4.5' }))
    this.names = plot.traces.map(({ label }, i) => write(label, { class: `lab-name ${colour('lab-name', i)}` }))
    this.svg.append(this.frame, this.field, ...this.ghosts, this.cursor, ...this.lines, this.marks, ...this.points, ...this.names)
    this.element = h('figure', { class: 'lab-chart' }, this.svg)
    this.element.style.setProperty('--height', `${plot.height ?? height}px`)
    this.width = this.height = 0
    this.data = this.ghost = null
    this.count = 0
    this.resizer = new ResizeObserver(([{ contentRect }]) => this.resize(contentRect.width, contentRect.height))
    this.resizer.observe(this.element)
    if (plot.x === null) this.watchPointer(seek)
  }

  watchPointer(seek) {
    this.svg.classList.add('lab-seek')
    const point = (event) => {
      const { left } = this.svg.getBoundingClientRect()
      seek(this.scaleX.invert(event.clientX - left))
    }
    this.svg.addEventListener('pointerdown', (event) => {
      if (event.button !== 0 || this.data === null) return
      this.svg.setPointerCapture(event.pointerId)
      point(event)
    })
    this.svg.addEventListener('pointermove', (event) => {
      if (this.svg.hasPointerCapture(event.pointerId)) point(event)
    })
  }

  /**
   * Show other curves.
   *
   * @param {{x: number[], traces: number[][]}} data @param {{x: number[], traces: number[][]} | null} ghost the curves of the start
   */
  set(data, ghost) {
    this.data = data
    this.ghost = ghost
    if (this.width > 0) this.layOut()
  }

  /** Show the lines up to a sample, and the point there. @param {number} count of samples @param {{x: number, values: number[]}} at */
  show(count, at) {
    this.count = count
    this.at = at
    if (this.width > 0 && this.data !== null) this.drawLines()
  }

  resize(width, height) {
    if (width < 60) return
    this.width = Math.floor(width)
    this.height = Math.floor(height)
    this.svg.setAttribute('viewBox', `0 0 ${this.width} ${this.height}`)
    if (this.data !== null) this.layOut()
  }

  /** Find the scales, and draw what does not move. */
  layOut() {
    const { plot, axis, width, height, data, ghost } = this
    const all = ghost === null ? [data] : [data, ghost]
    const range = (bounds, columns) => {
      const [least, most] = extent(columns)
      return spanOf(bounds, least, most)
    }
    const [low, high] = range(
      plot,
      [...all.flatMap(({ traces }) => traces), (plot.points?.data ?? []).map(([, y]) => y)],
    )
    const across =
      plot.x === null
        ? [axis.min, axis.max]
        : range(
            { ymin: plot.xmin, ymax: plot.xmax },
            all.map(({ x }) => x),
          )
    const ticksY = ticksOf(low, high, Math.max(2, Math.round((height - TOP - BOTTOM) / 42)))
    const left = 12 + LETTER * Math.max(...ticksY.map(({ text }) => text.length))
    const room = Math.min(14 + LETTER * Math.max(...plot.traces.map(({ label }) => label.length)), 0.3 * width)
    const right = width - (plot.x === null ? room : 12)
    const bottom = height - BOTTOM
    this.scaleX = scale(across[0], across[1], left, right)
    this.scaleY = scale(low, high, bottom, TOP)
    const ticksX = ticksOf(across[0], across[1], Math.max(2, Math.round((right - left) / 80)))
    const parts = []
    for (const { value, text } of ticksY) {
      const y = this.scaleY(value)
      parts.push(draw('path', { class: 'lab-grid', d: `M${left} ${y}H${right}` }))
      parts.push(write(text, { x: left - 6, y: y + 4, 'text-anchor': 'end' }))
    }
    for (const { value, text } of ticksX) {
      const x = this.scaleX(value)
      parts.push(draw('path', { class: 'lab-axis', d: `M${x} ${bottom}v4` }))
      parts.push(write(text, { x, y: bottom + 17, 'text-anchor': 'middle' }))
    }
    parts.push(draw('path', { class: 'lab-axis', d: `M${left} ${TOP}V${bottom}H${right}` }))
    parts.push(write(plot.ylabel || '', { x: 0, y: 12 }))
    parts.push(write(plot.xlabel || '', { x: (left + right) / 2, y: height - 5, 'text-anchor': 'middle' }))
    for (const { y: value, label } of plot.refLines) {
      if (value < low || value > high) continue
      const y = this.scaleY(value)
      parts.push(draw('path', { class: 'lab-reference', d: `M${left} ${y}H${right}` }))
      parts.push(write(label, { x: left + 4, y: y > TOP + 14 ? y - 4 : y + 13 }))
    }
    this.frame.replaceChildren(...parts)
    const marks = plot.points?.data ?? []
    this.marks.replaceChildren(...marks.map(([x, y]) => draw('circle', { cx: this.scaleX(x), cy: this.scaleY(clamp(y, this.scaleY)), r: 3 })))
    const last = marks[marks.length - 1]
    if (last && plot.points.label) {
      const place = { x: this.scaleX(last[0]), y: this.scaleY(clamp(last[1], this.scaleY)) - 9, 'text-anchor': 'end' }
      this.marks.append(write(plot.points.label, place))
    }
    this.ghosts.forEach((path, i) => path.setAttribute('d', ghost ? this.path(ghost.x, ghost.traces[i], ghost.x.length) : ''))
    this.field.setAttribute('d', plot.field ? this.arrows() : '')
    this.drawLines()
  }

  drawLines() {
    const { data, at, count, plot } = this
    this.lines.forEach((path, i) => path.setAttribute('d', this.path(data.x, data.traces[i], count)))
    const shown = at !== undefined && this.isInside(at.x)
    const x = shown ? this.scaleX(at.x) : 0
    this.cursor.setAttribute('d', shown && plot.x === null ? `M${x} ${TOP}V${this.height - BOTTOM}` : '')
    this.points.forEach((circle, i) => {
      const y = at?.values[i]
      const known = shown && Number.isFinite(y) && y >= this.scaleY.low && y <= this.scaleY.high
      circle.classList.toggle('lab-hidden', !known)
      if (!known) return
      circle.setAttribute('cx', String(x))
      circle.setAttribute('cy', String(this.scaleY(y)))
    })
    const ends = data.traces.map((values) => {
      for (let i = count - 1; i >= 0; i--) if (Number.isFinite(values[i])) return this.scaleY(clamp(values[i], this.scaleY))
      return null
    })
    const places = spread(ends, GAP, TOP + 4, this.height - BOTTOM)
    this.names.forEach((text, i) => {
      const hidden = places[i] === null || plot.x !== null
      text.classList.toggle('lab-hidden', hidden)
      text.setAttribute('x', String((count > 0 ? this.scaleX(data.x[count - 1]) : 0) + 9))
      text.setAttribute('y', String((places[i] ?? 0) + 4))
    })
  }

  isInside(x) {
    return Number.isFinite(x) && x >= this.scaleX.low && x <= this.scaleX.high
  }

  /** The path of a line, interrupted where it has no value, and cut at the lower and upper edges. */
  path(xs, ys, count) {
    const { scaleX, scaleY } = this
    let path = ''
    let pen = false
    const add = (x, y) => {
      path += `${pen ? 'L' : 'M'}${scaleX(x).toFixed(1)} ${scaleY(y).toFixed(1)}`
      pen = true
    }
    for (let i = 1; i < count; i++) {
      const [x0, y0, x1, y1] = [xs[i - 1], ys[i - 1], xs[i], ys[i]]
      if (!Number.isFinite(y0 - y1) || !Number.isFinite(x0 - x1)) {
        pen = false
        continue
      }
      const edges = [scaleY.low, scaleY.high].map((edge) => (edge - y0) / (y1 - y0)).sort((a, b) => a - b)
      const [from, to] = y0 === y1 ? (y0 === clamp(y0, scaleY) ? [0, 1] : [1, 0]) : [Math.max(edges[0], 0), Math.min(edges[1], 1)]
      if (from > to) {
        pen = false
        continue
      }
      if (!pen) add(x0 + from * (x1 - x0), y0 + from * (y1 - y0))
      add(x0 + to * (x1 - x0), y0 + to * (y1 - y0))
      pen = to === 1
    }
    return path
  }

  /** Short arrows of one length, in the direction of the motion. */
  arrows() {
    const { scaleX, scaleY } = this
    const [columns, rows] = ARROWS
    const unit = Math.min((scaleX.to - scaleX.from) / columns, (scaleY.from - scaleY.to) / rows)
    let path = ''
    for (let i = 0; i < columns; i++) {
      for (let j = 0; j < rows; j++) {
        const x = scaleX.from + ((i + 0.5) / columns) * (scaleX.to - scaleX.from)
        const y = scaleY.to + ((j + 0.5) / rows) * (scaleY.from - scaleY.to)
        const [dx, dy] = this.direction([scaleX.invert(x), scaleY.invert(y)])
        const [vx, vy] = [dx * scaleX.slope, dy * scaleY.slope]
        const speed = Math.hypot(vx, vy)
        if (!(speed > 0) || !Number.isFinite(speed)) continue
        const [ux, uy] = [(vx / speed) * 0.36 * unit, (vy / speed) * 0.36 * unit]
        path += `M${(x - ux).toFixed(1)} ${(y - uy).toFixed(1)}l${(2 * ux).toFixed(1)} ${(2 * uy).toFixed(1)}`
        path += `m${(-0.6 * ux - 0.4 * uy).toFixed(1)} ${(-0.6 * uy + 0.4 * ux).toFixed(1)}L${(x + ux).toFixed(1)} ${(y + uy).toFixed(1)}`
      }
    }
    return path
  }

  dispose() {
    this.resizer.disconnect()
  }
}

function write(text, attributes) {
  const element = draw('text', attributes)
  element.textContent = text
  return element
}

const colour = (name, i) => `${name}-${(i % COLOURS) + 1}`

function dashOf({ dash }, index) {
  if (Array.isArray(dash)) return dash.join(' ')
  return dash ? DASHES[1] : DASHES[index % DASHES.length]
}

/** A map from values to places on the drawing. */
function scale(low, high, from, to) {
  const slope = (to - from) / (high - low)
  const map = (value) => from + (value - low) * slope
  return Object.assign(map, { low, high, from, to, slope, invert: (place) => low + (place - from) / slope })
}

const clamp = (value, { low, high }) => Math.min(Math.max(value, low), high)

/** The least and the greatest finite value; undefined where there is none. */
function extent(columns) {
  let [low, high] = [Infinity, -Infinity]
  for (const column of columns) {
    for (const value of column) {
      if (!Number.isFinite(value)) continue
      if (value < low) low = value
      if (value > high) high = value
    }
  }
  return low <= high ? [low, high] : [undefined, undefined]
}

/** About `count` round numbers from `low` to `high`. */
function ticksOf(low, high, count) {
  const raw = (high - low) / count
  const power = 10 ** Math.floor(Math.log10(raw))
  const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((size) => size >= raw * 0.999) ?? raw
  const ticks = []
  for (let i = Math.ceil(low / step - 1e-9); i <= high / step + 1e-9 && ticks.length < 50; i++) {
    const value = Number((i * step).toPrecision(12))
    ticks.push({ value, text: formatLabel(value) })
  }
  return ticks.length > 0 ? ticks : [{ value: low, text: formatLabel(low) }]
}
