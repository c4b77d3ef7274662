/**
 * Plots of traces against time, drawn by uPlot: axes with labels, a colour and a dash for each line, a label at its end instead of a
 * legend, and lines for reference values. While the lab rests, a plot shows the whole run, pale outside its window; a pointer on it reads
 * values, and sets the time.
 */

import uPlot from 'uplot'
import { h } from './dom.js'
import { PLAYING, Samples } from './history.js'
import { formatLabel, formatTime, superscript } from './numbers.js'
import { palette, watchTheme } from './palette.js'
import { spanOf, spread } from './span.js'

export const HEIGHT = 170 // CSS pixels where texts have their usual size
const DASHES = [[], [7, 3], [2, 2.5], [9, 3, 2, 3], [4, 4], [12, 3]]
const FONT = Math.round(0.75 * parseFloat(getComputedStyle(document.documentElement).fontSize)) // CSS pixels; whole, since uPlot scales only the digits next to `px`
const GAP = 6
const LINE = FONT + GAP
const LINEAR = 1 // uPlot's kinds of scales
const LOGARITHMIC = 3
const MOST_POWERS = 6 // labels of a logarithmic axis
const FIGURES = 4 // of a value under the pointer
const SLOP = 4 // pixels that a pointer moves before it sets the time
const TICK = 5 // pixels, of the mark of a change
const NO_SPAN = [Infinity, -Infinity]
/** A plot of the lab's JSON with nothing in it. */
export const PLAIN_PLOT = {
  xlabel: '',
  ylabel: '',
  window: null,
  ymin: null,
  ymax: null,
  height: null,
  refLines: [],
  traces: [],
  log: false,
}

export class Plot extends Samples {
  /**
   * @param {any} config a plot of the lab's JSON; `log: true` gives it a logarithmic y axis
   * @param {(key: string, values?: Record<string, any>) => string} words
   * @param {((time: number) => void) | null} [seek] the reader points at a time (s)
   */
  constructor(config, words, seek = null) {
    super(config)
    /** @type {number | null} the time under the pointer (s) */
    this.pointed = null
    this.keptSpan = NO_SPAN
    this.caption = words('lab.plot', { ylabel: config.ylabel || words('lab.value'), xlabel: config.xlabel || words('lab.time') })
    this.element = h('figure', { class: 'lab-plot', role: 'img', 'aria-label': `${this.caption}: ${names(config)}` })
    this.chart = null
    this.element.style.setProperty('--height', `${(config.height ?? HEIGHT) / 16}rem`)
    this.resizer = new ResizeObserver(([{ contentRect }]) => this.resize(contentRect.width, contentRect.height))
    this.resizer.observe(this.element)
    this.unwatch = watchTheme(() => this.recolour())
    if (seek !== null) this.watchPointer(seek)
  }

  /**
   * Draw what is new.
   *
   * @param {{time: number, resting: boolean, marks: {time: number, label: string}[]}} [now] the time of the lab (s), whether it rests,
   *   and when which control was used
   */
  draw(now = PLAYING) {
    if (!this.take(now) || this.chart === null) return
    this.dirty = false
    this.chart.setData(this.history.data())
  }

  keep(on) {
    super.keep(on)
    const values = (this.kept ?? []).slice(1).flatMap((column) => [...column].filter(Number.isFinite))
    this.keptSpan = values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], NO_SPAN)
  }

  watchPointer(seek) {
    const { element } = this
    let start = null
    const timeAt = ({ clientX }) => {
      const { over } = this.chart
      const time = this.chart.posToVal(clientX - over.getBoundingClientRect().left, 'x')
      return Math.min(Math.max(time, 0), this.history.last)
    }
    const point = (time) => {
      if (time === this.pointed) return
      this.pointed = time
      this.chart?.redraw(false, false)
    }
    element.classList.add('lab-seek')
    element.addEventListener('pointerdown', (event) => {
      start = event.button === 0 ? event.clientX : null
      if (start !== null) element.setPointerCapture(event.pointerId)
    })
    element.addEventListener('pointermove', (event) => {
      if (this.chart === null || this.history.length === 0) return
      point(timeAt(event))
      if (start !== null && Math.abs(event.clientX - start) > SLOP) seek(this.pointed)
    })
    element.addEventListener('click', (event) => {
      if (this.chart !== null && this.history.length > 0) seek(timeAt(event))
    })
    for (const type of ['pointerup', 'pointercancel']) element.addEventListener(type, () => (start = null))
    element.addEventListener('pointerleave', () => point(null))
  }

  resize(width, height) {
    if (width < 40) return
    const size = { width: Math.floor(width), height: Math.floor(height) }
    if (this.chart === null) {
      this.colours = palette(this.element)
      this.chart = new uPlot(this.options(size), this.history.data(), this.element)
    } else this.chart.setSize(size)
  }

  recolour() {
    if (this.chart === null) return
    this.colours = palette(this.element)
    this.chart.redraw(false, false)
  }

  options(size) {
    const { config } = this
    const font = `${FONT}px ${getComputedStyle(this.element).fontFamily}`
    const axis = (label) => ({
      label,
      font,
      labelFont: font,
      labelGap: 0,
      labelSize: label ? LINE : 0,
      gap: 4,
      stroke: () => this.colours.text,
      grid: { stroke: () => this.colours.grid, width: 1 },
      ticks: { stroke: () => this.colours.grid, width: 1, size: 4 },
      border: { show: true, stroke: () => this.colours.rule, width: 1 },
      values: (_, ticks) => ticks.map(formatLabel),
    })
    return {
      ...size,
      padding: [config.ylabel ? LINE + GAP : FONT, this.labelRoom(font), 0, 0],
      legend: { show: false },
      cursor: { show: false },
      scales: {
        x: { time: false, range: () => this.timeRange() },
        y: {
          distr: config.log ? LOGARITHMIC : LINEAR,
          range: (_, min, max) => {
            const low = Math.min(min ?? Infinity, this.keptSpan[0])
            const high = Math.max(max ?? -Infinity, this.keptSpan[1])
            return config.log ? decades(config, low, high) : spanOf(config, low, high)
          },
        },
      },
      axes: [
        { ...axis(config.xlabel || ''), size: FONT + 10, space: 45 },
        { ...axis(''), size: (_, values) => sizeOf(values, font), space: 28, ...(config.log ? POWERS : {}) },
      ],
      series: [
        {},
        ...config.traces.map((trace, i) => ({
          stroke: (chart) => this.inkOf(chart, i),
          width: 1.6,
          dash: dashOf(trace, i, config.traces.length),
          points: { show: false },
        })),
      ],
      hooks: {
        drawAxes: [(chart) => this.drawTitle(chart, font), (chart) => this.drawReferences(chart, font), (chart) => this.drawKept(chart)],
        draw: [(chart) => this.drawLabels(chart, font), (chart) => this.drawTime(chart, font)],
      },
    }
  }

  timeRange() {
    const { window } = this.config
    const { last } = this.history
    if (window === null || this.now.resting) return [0, Math.max(window ?? 1, last, this.kept?.[0].at(-1) ?? 0)]
    return last <= window ? [0, window] : [last - window, last]
  }

  /** The colour of a line: outside the window, and after the time at which the lab rests, it is pale. */
  inkOf({ ctx, bbox, valToPos }, i) {
    const ink = this.colours.traces[i % this.colours.traces.length]
    const { time, resting } = this.now
    const { last } = this.history
    const from = time - (this.config.window ?? Infinity)
    if (!resting || (time >= last && from <= 0)) return ink
    const pale = faint(ink)
    const { left, width } = bbox
    const part = (at) => Math.min(1, Math.max(0, (valToPos(Math.max(0, at), 'x', true) - left) / width))
    const gradient = ctx.createLinearGradient(left, 0, left + width, 0)
    const stops = [[0, pale], [part(from), pale], [part(from), ink], [part(time), ink], [part(time), pale], [1, pale]]
    for (const [place, colour] of stops) gradient.addColorStop(/** @type {number} */ (place), /** @type {string} */ (colour))
    return gradient
  }

  /** Width of the labels at the ends of the lines. */
  labelRoom(font) {
    const { traces } = this.config
    return traces.length === 0
      ? GAP
      : Math.min(140, Math.ceil(Math.max(...traces.map(({ label }) => widthOf(label, font))) + 2 * GAP))
  }

  /** Draw the label of the y axis above it, as along the axis a long one would be cut. */
  drawTitle({ ctx }, font) {
    const ratio = uPlot.pxRatio
    ctx.save()
    ctx.font = scaleFont(font, ratio)
    ctx.fillStyle = this.colours.text
    ctx.textAlign = 'left'
    ctx.textBaseline = 'top'
    ctx.fillText(this.config.ylabel || '', 0, 0)
    ctx.restore()
  }

  /** Draw the lines for reference values; their labels stand on the left, or on the right while the lines end near there. */
  drawReferences({ ctx, bbox, data, valToPos }, font) {
    const ratio = uPlot.pxRatio
    const end = data[0].length === 0 ? 0 : valToPos(data[0].at(-1), 'x', true) - bbox.left
    const { refLines } = this.config
    const [top, bottom] = [bbox.top, bbox.top + bbox.height]
    const pixels = refLines.map(({ y }) => Math.round(valToPos(y, 'y', true))).map((pixel) => (pixel < top || pixel > bottom ? null : pixel))
    const places = spread(pixels.map((pixel) => pixel && pixel - (2 + FONT / 2) * ratio), FONT * ratio, 0, bottom)
    ctx.save()
    ctx.strokeStyle = ctx.fillStyle = this.colours.text
    ctx.lineWidth = ratio
    ctx.setLineDash([2 * ratio, 3 * ratio])
    ctx.beginPath()
    for (const pixel of pixels) {
      if (pixel === null) continue
      ctx.moveTo(bbox.left, pixel)
      ctx.lineTo(bbox.left + bbox.width, pixel)
    }
    ctx.stroke()
    ctx.font = scaleFont(font, ratio)
    ctx.textAlign = 'left'
    ctx.textBaseline = 'middle'
    pixels.forEach((pixel, i) => {
      const { label } = refLines[i]
      if (pixel === null || !label) return
      const { width } = ctx.measureText(label)
      const left = bbox.left + (end > width + 2 * GAP * ratio ? GAP * ratio : bbox.width - width)
      ctx.clearRect(left, places[i] - (FONT / 2) * ratio, width, FONT * ratio) // no other line crosses it
      ctx.fillText(label, left, places[i])
    })
    ctx.restore()
  }

  /** Draw the lines of the run that was kept. */
  drawKept({ ctx, bbox, scales, valToPos }) {
    if (this.kept === null) return
    const [times, ...columns] = this.kept
    ctx.save()
    ctx.beginPath()
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
    ctx.clip()
    ctx.lineWidth = uPlot.pxRatio
    columns.forEach((column, i) => {
      ctx.strokeStyle = faint(this.colours.traces[i % this.colours.traces.length])
      ctx.beginPath()
      let isDrawing = false
      times.forEach((time, j) => {
        const isShown = time >= scales.x.min && Number.isFinite(column[j])
        if (isShown) ctx[isDrawing ? 'lineTo' : 'moveTo'](valToPos(time, 'x', true), valToPos(column[j], 'y', true))
        isDrawing = isShown
      })
      ctx.stroke()
    })
    ctx.restore()
  }

  drawLabels(chart, font) {
    const { ctx, bbox, valToPos } = chart
    const { traces } = this.config
    const data = chart.data
    const end = data[0].length - 1
    const ratio = uPlot.pxRatio
    const ends = traces.map((_, i) =>
      end < 0 || !Number.isFinite(data[i + 1][end]) ? null : valToPos(data[i + 1][end], 'y', true),
    )
    const places = spread(ends, (FONT + 2) * ratio, bbox.top, bbox.top + bbox.height)
    const x = Math.min(bbox.left + bbox.width, end < 0 ? bbox.left : valToPos(data[0][end], 'x', true))
    ctx.save()
    ctx.font = scaleFont(font, ratio)
    ctx.textAlign = 'left'
    ctx.textBaseline = 'middle'
    traces.forEach(({ label }, i) => {
      if (places[i] === null) return
      ctx.fillStyle = this.colours.traces[i % this.colours.traces.length]
      ctx.fillText(label, x + GAP * ratio, places[i])
    })
    ctx.restore()
  }

  /** Draw when controls were used, and the values under the pointer, or at the earlier time at which the lab rests. */
  drawTime(chart, font) {
    const { ctx, bbox, valToPos, scales } = chart
    const { time, resting, marks } = this.now
    const { last } = this.history
    const ratio = uPlot.pxRatio
    const bottom = bbox.top + bbox.height
    const place = (at) => Math.round(valToPos(at, 'x', true))
    const at = this.pointed ?? (resting && time < last ? time : null)
    ctx.save()
    ctx.fillStyle = ctx.strokeStyle = this.colours.text
    ctx.lineWidth = ratio
    const shown = marks.filter((mark) => mark.time >= scales.x.min)
    for (const mark of shown) {
      const x = place(mark.time)
      ctx.beginPath()
      ctx.moveTo(x, bottom - 2 * TICK * ratio)
      ctx.lineTo(x - TICK * ratio, bottom)
      ctx.lineTo(x + TICK * ratio, bottom)
      ctx.fill()
    }
    if (at !== null && last > 0) {
      const x = place(at)
      ctx.beginPath()
      ctx.moveTo(x, bbox.top)
      ctx.lineTo(x, bottom)
      ctx.stroke()
      const near = shown.filter((mark) => Math.abs(place(mark.time) - x) <= TICK * ratio).map(({ label }) => label)
      this.drawValues(chart, font, at, [`${formatTime(at)} s`, ...near].join(', '))
    }
    ctx.restore()
  }

  drawValues({ ctx, bbox, valToPos }, font, at, text) {
    const ratio = uPlot.pxRatio
    const x = valToPos(at, 'x', true)
    const values = this.history.at(at)
    const pixels = values.map((value) => (Number.isFinite(value) ? valToPos(value, 'y', true) : null))
    const places = spread([bbox.top + (FONT / 2) * ratio, ...pixels], (FONT + 2) * ratio, bbox.top + (FONT / 2) * ratio, bbox.top + bbox.height)
    const isLeft = x < bbox.left + bbox.width / 2
    ctx.font = scaleFont(font, ratio)
    ctx.textAlign = isLeft ? 'left' : 'right'
    ctx.textBaseline = 'middle'
    const write = (words, y, colour) => {
      const { width } = ctx.measureText(words)
      const edge = x + (isLeft ? GAP : -GAP) * ratio
      ctx.clearRect(isLeft ? edge : edge - width, y - (FONT / 2) * ratio, width, FONT * ratio)
      ctx.fillStyle = colour
      ctx.fillText(words, edge, y)
    }
    write(text, places[0], this.colours.text)
    values.forEach((value, i) => {
      if (pixels[i] === null) return
      const colour = this.colours.traces[i % this.colours.traces.length]
      write(formatLabel(Number(value.toPrecision(FIGURES))), places[i + 1], colour)
      ctx.beginPath()
      ctx.arc(x, pixels[i], 3 * ratio, 0, 2 * Math.PI)
      ctx.fill()
    })
  }

  dispose() {
    this.unwatch()
    this.resizer.disconnect()
    this.chart?.destroy()
  }
}

const faint = (colour) => colour.replace('rgb(', 'rgba(').replace(')', ', 0.35)')

const names = ({ traces }) => traces.map(({ label }) => label).join(', ')

function dashOf({ dash }, index, count) {
  if (Array.isArray(dash)) return dash
  if (dash) return DASHES[1]
  return count > 1 ? DASHES[index % DASHES.length] : []
}

/** The range of a logarithmic axis: whole decades around the data. */
function decades({ ymin, ymax }, low, high) {
  const lower = ymin ?? 10 ** Math.floor(Math.log10(low > 0 ? low : 1e-3))
  const upper = ymax ?? 10 ** Math.ceil(Math.log10(high > 0 ? high : 1))
  return [lower, upper > lower ? upper : 10 * lower]
}

/** Ticks of a logarithmic axis: at powers of ten, not more than can be read. */
const POWERS = {
  splits: (_, __, min, max) => {
    const first = Math.ceil(Math.log10(min) - 1e-9)
    const last = Math.floor(Math.log10(max) + 1e-9)
    const stride = Math.max(1, Math.ceil((last - first) / MOST_POWERS))
    return Array.from({ length: Math.floor((last - first) / stride) + 1 }, (___, i) => 10 ** (first + i * stride))
  },
  filter: (_, splits) => splits,
  values: (_, ticks) => ticks.map((tick) => `10${superscript(Math.round(Math.log10(tick)))}`),
}

const scaleFont = (font, ratio) => font.replace(/^[\d.]+/, String(FONT * ratio))

let measureContext = null

function widthOf(text, font) {
  measureContext ??= document.createElement('canvas').getContext('2d')
  measureContext.font = font
  return measureContext.measureText(text).width
}

function sizeOf(values, font) {
  return 12 + Math.ceil(Math.max(14, ...(values ?? []).map((value) => widthOf(value, font))))
}
