/**
 * A plot as SVG: axes, lines with their names at the ends, arrows of a phase plane, and the values where the reader points. Style sheets
 * colour it, as they do the plots of the static form.
 */

import { draw, freshId, h } from './dom.js'
import { valuesAt } from './history.js'
import { formatLabel, superscript } from './numbers.js'
import { spanOf, spread } from './span.js'

const PIXEL = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16 // where texts have their usual size
const DASHES = ['', '6 3', '2 3', '8 3 2 3', '1 4']
const LETTER = 7 * PIXEL // of a letter or a digit
const TOP = 24 * PIXEL
const BOTTOM = 38 * PIXEL
const GAP = 13 * PIXEL // between names
const ROOM = 9 // px beside a point
const FAR = 1e4 // px, beyond which a line goes up or down whatever its value
const FIGURES = 4 // of a value where the reader points
const MOST_POWERS = 6 // labels of a logarithmic axis
const SLOP = 4 // px that a pointer moves before it sets the time
const ARROWS = [17, 11] // of a field, across and up
const COLOURS = 6

/**
 * What a plot shows: samples at `times`, whose `traces` stand over `x`, and earlier curves, pale, in `ghost`. `at` is the time that the
 * lab shows. Its lines reach from `from` to `to` (that time, where nothing else is said), and are pale outside if that is asked for.
 * `across` is the range of the horizontal axis, or null, if it follows the data and the times are not on it.
 *
 * @typedef {{x: ArrayLike<number>, traces: ArrayLike<number>[]}} Curves
 * @typedef {Curves & {times: ArrayLike<number>, ghost: Curves | null, across: number[] | null, at: number, from?: number, to?: number,
 *   pale?: boolean, marks?: {time: number, label: string}[]}} Shown `marks`: when which control was used
 */

export class Chart {
  /**
   * @param {Record<string, any>} plot of the lab's JSON
   * @param {{words: (key: string, values?: Record<string, any>) => string, across: string, height: number, format: (time: number) => string,
   *   seek: ((time: number) => void) | null, direction?: (point: [number, number]) => number[]}} options `across`: what the horizontal
   *   axis is, if its label does not say; `seek`: the reader points at a time
   */
  constructor(plot, { words, across, height, format, seek, direction }) {
    this.words = words
    this.across = across
    this.format = format
    this.direction = direction
    this.svg = draw('svg', { role: 'img' })
    this.name(plot)
    const clip = freshId('plot')
    this.edge = draw('rect')
    this.frame = draw('g')
    this.field = draw('path', { class: 'lab-field' })
    this.ghosts = plot.traces.map((_, i) => draw('path', { class: `lab-ghost ${colour(i)}` }))
    this.lines = plot.traces.map((trace, i) => draw('path', { class: `lab-trace ${colour(i)}`, 'stroke-dasharray': dashOf(trace, i) }))
    this.measured = draw('g', { class: 'lab-measured' })
    this.changes = draw('path', { class: 'lab-change' })
    this.cursor = draw('path', { class: 'lab-cursor' })
    this.points = plot.traces.map((_, i) => draw('circle', { class: `lab-point ${colour(i)}`, r: '4.5' }))
    this.names = plot.traces.map(({ label }, i) => write(label, { class: `lab-name ${colour(i)}` }))
    this.notes = [write('', { class: 'lab-over' }), ...plot.traces.map((_, i) => write('', { class: `lab-over lab-name ${colour(i)}` }))]
    const hole = draw('clipPath', { id: clip })
    hole.append(this.edge)
    const inside = draw('g', { 'clip-path': `url(#${clip})` })
    inside.append(this.field, ...this.ghosts, ...this.lines)
    this.svg.append(hole, this.frame, this.cursor, inside, this.measured, this.changes, ...this.points, ...this.names, ...this.notes)
    this.element = h('figure', { class: 'lab-chart' }, this.svg)
    this.element.style.setProperty('--height', `${(plot.height ?? height) / 16}rem`)
    this.width = this.height = 0
    /** @type {Shown | null} */
    this.shown = null
    /** @type {number | null} the time at which the reader points */
    this.pointed = null
    this.resizer = new ResizeObserver(([{ contentRect }]) => this.resize(contentRect.width, contentRect.height))
    this.resizer.observe(this.element)
    if (seek !== null) this.watchPointer(seek)
  }

  /** Take the names and ranges of the axes from a plot of the lab's JSON. */
  name(plot) {
    const { words, across } = this
    this.plot = plot
    this.layout = '' // of the axes, as they are drawn
    this.caption = words('lab.plot', { ylabel: plot.ylabel || words('lab.value'), xlabel: plot.xlabel || across })
    this.svg.setAttribute('aria-label', `${this.caption}: ${plot.traces.map(({ label }) => label).join(', ')}`)
  }

  watchPointer(seek) {
    const { svg } = this
    let start = null
    const point = (time) => {
      this.pointed = time
      if (this.layout !== '') this.drawTime()
    }
    svg.classList.add('lab-seek')
    svg.addEventListener('pointerdown', (event) => {
      start = event.button === 0 ? event.clientX : null
      if (start !== null) svg.setPointerCapture(event.pointerId)
    })
    svg.addEventListener('pointermove', (event) => {
      if (!this.shown?.times.length) return
      point(this.timeAt(event))
      if (start !== null && Math.abs(event.clientX - start) > SLOP) seek(this.pointed)
    })
    svg.addEventListener('click', (event) => {
      if (this.shown?.times.length) seek(this.timeAt(event))
    })
    for (const type of ['pointerup', 'pointercancel']) svg.addEventListener(type, () => (start = null))
    svg.addEventListener('pointerleave', () => point(null))
  }

  /** The time at a pointer: of its place on the axis, or, without one, of the sample that is nearest to it. */
  timeAt({ clientX, clientY }) {
    const { scaleX, scaleY } = this
    const { left, top } = this.svg.getBoundingClientRect()
    const { times, x, traces, across } = this.shown
    if (across !== null) return clamp(scaleX.invert(clientX - left), { low: times[0], high: times[times.length - 1] })
    let [least, nearest] = [Infinity, 0]
    for (const values of traces) {
      for (let i = 0; i < times.length; i++) {
        const distance = Math.hypot(scaleX(x[i]) + left - clientX, scaleY(values[i]) + top - clientY)
        if (distance < least) [least, nearest] = [distance, i]
      }
    }
    return times[nearest]
  }

  /** @param {Shown} shown */
  draw(shown) {
    this.shown = shown
    if (this.width === 0) return
    this.layOut()
    this.drawLines()
    this.drawTime()
  }

  resize(width, height) {
    if (width < 60) return
    this.width = Math.floor(width)
    this.height = Math.floor(height)
    this.svg.setAttribute('viewBox', `0 0 ${this.width} ${this.height}`)
    if (this.shown !== null) this.draw(this.shown)
  }

  /** Whether the ends of lines have names; the axes alone name what one line shows over another quantity. */
  get isNamed() {
    return this.shown.across !== null || this.shown.traces.length > 1
  }

  /** Find the scales, and draw what does not move, unless it stands there. */
  layOut() {
    const { plot, width, height, shown } = this
    const all = shown.ghost === null ? [shown] : [shown, shown.ghost]
    const measured = plot.points?.data ?? []
    const [least, most] = extent([...all.flatMap(({ traces }) => traces), measured.map(([, y]) => y)])
    const [low, high] = plot.log ? decades(plot, least, most) : spanOf(plot, least, most)
    const [first, last] = extent(all.map(({ x }) => x))
    const [start, end] = shown.across ?? spanOf({ ymin: plot.xmin, ymax: plot.xmax }, first, last)
    const layout = [low, high, start, end, width, height].join()
    if (layout === this.layout) return
    this.layout = layout
    const bottom = height - BOTTOM
    const ticksY = (plot.log ? powersOf : ticksOf)(low, high, Math.max(2, Math.round((bottom - TOP) / (30 * PIXEL))))
    const left = 12 + LETTER * Math.max(...ticksY.map(({ text }) => text.length))
    const room = Math.min(14 + LETTER * Math.max(...plot.traces.map(({ label }) => label.length)), 0.3 * width)
    const right = width - (this.isNamed ? room : 12)
    this.scaleX = scale(start, end, left, right)
    this.scaleY = scale(low, high, bottom, TOP, plot.log)
    for (const [name, value] of Object.entries({ x: left, y: TOP, width: right - left, height: bottom - TOP })) {
      this.edge.setAttribute(name, String(value))
    }
    const parts = []
    for (const { value, text } of ticksY) {
      const y = this.scaleY(value)
      parts.push(draw('path', { class: 'lab-grid', d: `M${left} ${y}H${right}` }))
      parts.push(write(text, { x: left - 6, y: y + 4, 'text-anchor': 'end' }))
    }
    for (const { value, text } of ticksOf(start, end, Math.max(2, Math.round((right - left) / (60 * PIXEL))))) {
      const x = this.scaleX(value)
      parts.push(draw('path', { class: 'lab-axis', d: `M${x} ${bottom}v4` }))
      parts.push(write(text, { x, y: bottom + 17 * PIXEL, 'text-anchor': 'middle' }))
    }
    parts.push(draw('path', { class: 'lab-axis', d: `M${left} ${TOP}V${bottom}H${right}` }))
    parts.push(write(plot.ylabel || '', { x: 0, y: 12 * PIXEL }))
    parts.push(write(plot.xlabel || '', { x: (left + right) / 2, y: height - 5, 'text-anchor': 'middle' }))
    const lines = (plot.refLines ?? []).filter(({ y }) => y >= low && y <= high)
    const places = spread(lines.map(({ y }) => this.scaleY(y) - 4), GAP, TOP + GAP, bottom)
    lines.forEach(({ y, label }, i) => {
      parts.push(draw('path', { class: 'lab-reference', d: `M${left} ${this.scaleY(y)}H${right}` }))
      parts.push(write(label, { class: 'lab-over', x: left + 4, y: places[i] }))
    })
    this.frame.replaceChildren(...parts)
    const marks = measured.map(([x, y]) => draw('circle', { cx: this.scaleX(x), cy: this.scaleY(clamp(y, this.scaleY)), r: 3 }))
    this.measured.replaceChildren(...marks)
    const point = measured[measured.length - 1]
    if (point && plot.points.label) {
      const place = { x: this.scaleX(point[0]), y: this.scaleY(clamp(point[1], this.scaleY)) - 9, 'text-anchor': 'end' }
      this.measured.append(write(plot.points.label, place))
    }
  }

  drawLines() {
    const { shown, plot, scaleX, scaleY } = this
    const { times, x, traces, ghost, at, from = -Infinity, to = at, pale = false } = shown
    const count = times.length
    let [first, end] = [0, count]
    while (first < count && times[first] < from) first += 1
    while (end > first && times[end - 1] > to) end -= 1
    if (plot.field) this.field.setAttribute('d', this.arrows())
    traces.forEach((values, i) => {
      const earlier = ghost === null ? '' : this.path(ghost.x, ghost.traces[i], 0, ghost.x.length)
      this.ghosts[i].setAttribute('d', earlier + (pale ? this.path(x, values, 0, count) : ''))
      this.lines[i].setAttribute('d', this.path(x, values, first, end))
    })
    const last = (pale ? count : end) - 1
    const ends = traces.map((values) => {
      for (let i = last; i >= 0; i--) if (Number.isFinite(scaleY(values[i]))) return scaleY(clamp(values[i], scaleY))
      return null
    })
    const places = spread(ends, GAP, TOP + 4, this.height - BOTTOM)
    this.names.forEach((text, i) => {
      text.classList.toggle('lab-hidden', !this.isNamed || places[i] === null)
      if (places[i] !== null) put(text, scaleX(x[last]) + ROOM, places[i] + 4)
    })
  }

  /** Draw when controls were used, and the values at the time that is shown or at which the reader points. */
  drawTime() {
    const { shown, scaleX, scaleY, height } = this
    const { times, x, traces, at, pale, across, marks = [] } = shown
    const [bottom, count] = [height - BOTTOM, times.length]
    const time = this.pointed ?? at
    const isRead = count > 0 && (this.pointed !== null || (pale === true && at < times[count - 1]))
    const [along, ...values] = valuesAt(times, [x, ...traces], time)
    const place = scaleX(along)
    const isSeen = count > 0 && along >= scaleX.low && along <= scaleX.high
    this.cursor.setAttribute('d', isSeen && across !== null ? `M${place} ${TOP}V${bottom}` : '')
    const changes = across === null ? [] : marks.filter((mark) => mark.time >= scaleX.low)
    this.changes.setAttribute('d', changes.map((mark) => `M${scaleX(mark.time)} ${bottom - 10}l-5 10h10z`).join(''))
    const pixels = values.map((y) => (isSeen && y >= scaleY.low && y <= scaleY.high ? scaleY(y) : null))
    this.points.forEach((circle, i) => {
      circle.classList.toggle('lab-hidden', pixels[i] === null)
      if (pixels[i] !== null) put(circle, place, pixels[i], 'c')
    })
    const near = changes.filter((mark) => Math.abs(scaleX(mark.time) - place) <= 5).map(({ label }) => label)
    const texts = [[this.format(time), ...near].join(', '), ...values.map((y) => formatLabel(Number(y?.toPrecision(FIGURES))))]
    const isLeft = place < (scaleX.from + scaleX.to) / 2
    const places = spread([isSeen ? TOP + 4 : null, ...pixels], GAP, TOP + 4, bottom)
    this.notes.forEach((text, i) => {
      text.classList.toggle('lab-hidden', !isRead || places[i] === null)
      if (!isRead || places[i] === null) return
      text.textContent = texts[i]
      text.setAttribute('text-anchor', isLeft ? 'start' : 'end')
      put(text, place + (isLeft ? ROOM : -ROOM), places[i] + 4)
    })
  }

  /** The path of a line through some samples, interrupted where it has no value; of those that share a place across, where it turns. */
  path(xs, ys, from, to) {
    const { scaleX, scaleY } = this
    const { low, high } = scaleX
    const side = (i) => Number(xs[i] > high) - Number(xs[i] < low)
    const goesOn = (values, i) => (values[i] - values[i - 1]) * (values[i + 1] - values[i]) >= 0
    let path = ''
    let last = NaN // across; NaN: the line begins
    for (let i = from; i < to; i++) {
      const [x, y] = [scaleX(xs[i]), scaleY(ys[i])]
      if (!Number.isFinite(x + y)) last = NaN
      else if (Number.isNaN(last) || i + 1 === to || !(Math.abs(x - last) < 1 && goesOn(xs, i) && goesOn(ys, i))) {
        if (side(i) !== 0 && side(i - 1) === side(i) && side(i + 1) === side(i)) continue
        path += `${Number.isNaN(last) ? 'M' : 'L'}${x.toFixed(1)} ${Math.min(Math.max(y, -FAR), FAR).toFixed(1)}`
        last = x
      }
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

function put(element, x, y, prefix = '') {
  element.setAttribute(`${prefix}x`, x.toFixed(1))
  element.setAttribute(`${prefix}y`, y.toFixed(1))
}

const colour = (i) => `lab-trace-${(i % COLOURS) + 1}`

function dashOf({ dash }, index) {
  if (Array.isArray(dash)) return dash.join(' ')
  return dash ? DASHES[1] : DASHES[index % DASHES.length]
}

/** A map from values to places on the drawing. */
function scale(low, high, from, to, isLogarithmic = false) {
  const of = isLogarithmic ? Math.log : (value) => value
  const slope = (to - from) / (of(high) - of(low))
  const map = (value) => from + (of(value) - of(low)) * slope
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

/** The range of a logarithmic axis: whole decades around the data. */
function decades({ ymin = null, ymax = null }, low, high) {
  const lower = ymin ?? 10 ** Math.floor(Math.log10(low > 0 ? low : 1e-3))
  const upper = ymax ?? 10 ** Math.ceil(Math.log10(high > 0 ? high : 1))
  return [lower, upper > lower ? upper : 10 * lower]
}

/** Powers of ten from `low` to `high`, not more than can be read. */
function powersOf(low, high) {
  const first = Math.ceil(Math.log10(low) - 1e-9)
  const last = Math.floor(Math.log10(high) + 1e-9)
  const stride = Math.max(1, Math.ceil((last - first) / MOST_POWERS))
  return Array.from({ length: Math.max(0, Math.floor((last - first) / stride)) + 1 }, (_, i) => {
    const power = first + i * stride
    return { value: 10 ** power, text: `10${superscript(power)}` }
  })
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
