/**
 * The picture of a lab: an element of the page, a camera, and the world that it sees.
 *
 * The element holds a 2-D canvas with the last picture and, while the view moves, the stage's canvas above it (see `stage.js`).
 */

import { PerspectiveCamera } from 'three'
import { ModelCamera, OrbitCamera } from './camera.js'
import { h, outline } from './dom.js'
import { formatRough } from './numbers.js'
import { stage } from './stage.js'
import { STUDIO_LAYER, roundLength } from './studio.js'
import { World, aim } from './world.js'

const CAMERA = 13 // floats of a camera in a frame
const LONGEST = 0.2 // of the view's width, for the scale bar
const MARGIN = 10 // CSS pixels, around that bar
const TICK = 5

export class View {
  /**
   * @param {object} options
   * @param {number} options.height CSS pixels, where it is 480 wide
   * @param {string} options.label describes the picture for those who cannot see it
   * @param {string} options.name of the view, and how keys move it
   * @param {(key: string, values?: Record<string, any>) => string} options.words
   * @param {HTMLImageElement | null} [options.poster] a picture that is shown until there is a live one
   */
  constructor({ height, label, name, words, poster = null }) {
    this.label = label
    this.still = h('canvas', { class: 'lab-still', role: 'img', 'aria-label': label })
    this.element = h('div', { class: 'lab-view', tabIndex: 0, role: 'group', 'aria-label': name }, this.still)
    this.poster = poster === null ? null : h('img', { class: 'lab-poster', src: poster.src, alt: '' })
    if (this.poster !== null) {
      this.poster.style.setProperty('--ratio', Number(poster.getAttribute('width')) / Number(poster.getAttribute('height')))
      this.element.append(this.poster)
    }
    this.scale = new ScaleBar(words)
    this.element.style.setProperty('--height', height)
    this.lens = new PerspectiveCamera()
    this.lens.matrixAutoUpdate = false
    this.lens.layers.enable(STUDIO_LAYER)
    this.world = null
    this.camera = null
    this.frame = null
    this.rate = Infinity // pictures a second, if they are too few (stage.js)
    this.ghost = null // another pose that is shown, see `World.pose`
    this.width = 0
    this.height = 0
    this.resizer = new ResizeObserver(([{ contentRect }]) => this.resize(contentRect.width, contentRect.height))
    this.resizer.observe(this.element)
    this.unwatch = watchTheme(() => this.colour())
  }

  get scene() {
    return this.world?.scene ?? null
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return
    this.width = Math.round(width)
    this.height = Math.round(height)
    this.invalidate()
  }

  /** Show a model. Throws if there is no WebGL. */
  open(description) {
    stage.add(this)
    this.world?.dispose()
    this.world = new World(description)
    this.camera = this.freeCamera = new OrbitCamera(description.camera)
    this.frame = null
    this.colour()
  }

  /** Look through a camera of the model, or through the free one (-1). */
  look(camera) {
    if (this.world === null) return
    this.camera = this.freeCamera
    if (camera >= 0 && this.frame !== null) {
      const { layout, extent } = this.world.description
      this.camera = new ModelCamera(layout.cameras + CAMERA * camera, extent)
      this.camera.follow(this.frame)
    }
    this.invalidate()
  }

  /** Apply the page's colours. */
  colour() {
    const probe = h('span', { hidden: true }) // style sheets do not apply to a canvas
    probe.style.color = 'var(--trace-2)'
    this.element.append(probe)
    this.world?.trail?.paint(getComputedStyle(probe).color)
    probe.remove()
    this.invalidate()
  }

  /** Show a frame from the next drawing on; returns the previous frame, which is no longer used. */
  setFrame(frame) {
    const spent = this.frame
    this.frame = frame
    this.invalidate()
    return spent
  }

  /** Plan to draw the picture again. */
  invalidate() {
    if (this.world !== null) stage.invalidate(this)
  }

  setMoving(isMoving) {
    if (this.world !== null) stage.setMoving(this, isMoving)
  }

  // --- called by the stage

  /** Make ready for drawing; false if there is nothing to draw. */
  prepare() {
    if (this.world === null || this.frame === null || this.width === 0 || this.height === 0) return false
    if (this.camera instanceof ModelCamera) this.camera.follow(this.frame)
    this.world.update(this.frame, this.camera, this.ghost)
    aim(this.lens, this.camera, this.world.description, this.width, this.height)
    this.world.edges.update(this.width, this.height)
    if (!this.scale.element.isConnected) this.element.append(this.scale.element)
    const viewHeight = 2 * this.camera.distance * Math.tan((this.lens.fov * Math.PI) / 360)
    this.scale.show(this.width, this.height, this.height / viewHeight)
    return true
  }

  /** Draw the reflection for the picture; returns whether there is one. */
  reflect(stage) {
    return this.world.mirror?.draw(stage, this.scene, this.lens, this.width, this.height) ?? false
  }

  takeCanvas(canvas) {
    canvas.setAttribute('role', 'img')
    canvas.setAttribute('aria-label', this.label)
    this.poster?.remove()
    this.still.hidden = true
    this.element.append(canvas)
  }

  /** Copy the picture on the stage's canvas. */
  copyCanvas(canvas) {
    const { still } = this
    this.poster?.remove()
    if (still.width !== canvas.width || still.height !== canvas.height) {
      still.width = canvas.width
      still.height = canvas.height
    }
    const context = still.getContext('2d')
    context.clearRect(0, 0, still.width, still.height)
    context.drawImage(canvas, 0, 0)
    still.hidden = false
  }

  // --- geometry of the pointer

  /** A place in the window as coordinates of the view, in [-1, 1], to the right and up. @returns {[number, number]} */
  coordinates(clientX, clientY) {
    const box = this.element.getBoundingClientRect()
    return [(2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height]
  }

  /** The movable body under the pointer. */
  pick(clientX, clientY) {
    return this.world?.pick(...this.coordinates(clientX, clientY), this.lens) ?? null
  }

  /** The point under the pointer that is as deep in the picture as `point` (m, world). */
  atDepth(clientX, clientY, point) {
    const { right, up, forward } = this.camera.axes()
    const eye = this.camera.position()
    const depth = point.reduce((sum, x, i) => sum + (x - eye[i]) * forward[i], 0)
    const half = depth * Math.tan((this.lens.fov * Math.PI) / 360)
    const [x, y] = this.coordinates(clientX, clientY)
    const aspect = this.width / this.height
    return eye.map((e, i) => e + depth * forward[i] + half * (x * aspect * right[i] + y * up[i]))
  }

  dispose() {
    this.unwatch()
    this.resizer.disconnect()
    stage.remove(this)
    this.world?.dispose()
    this.world = null
  }
}

/** A scale bar in the corner of a view: a round length at the distance of the camera's target. */
class ScaleBar {
  /** @param {(key: string, values?: Record<string, any>) => string} words */
  constructor(words) {
    this.words = words
    this.svg = outline('')
    this.length = h('span')
    this.element = h('p', { class: 'lab-scale', role: 'img' }, this.svg, this.length)
  }

  /** Fit the bar to a view of `width` by `height` CSS pixels, of which a metre has `metre`. */
  show(width, height, metre) {
    const length = roundLength((LONGEST * width) / metre)
    this.element.hidden = !Number.isFinite(length * metre) // of a model as large as numbers go
    if (this.element.hidden) return
    const path = `M${MARGIN} ${height - MARGIN - TICK}v${TICK}h${(length * metre).toFixed(1)}v${-TICK}`
    if (path === this.path) return
    this.path = path
    this.svg.setAttribute('viewBox', `0 0 ${width} ${height}`)
    this.svg.firstElementChild.setAttribute('d', path)
    const text = `${formatRough(length)} m`
    if (text === this.length.textContent) return
    this.length.textContent = text
    this.element.setAttribute('aria-label', this.words('lab.scale', { length: text }))
  }
}

/**
 * Call `callback` when the page changes between light and dark.
 *
 * @returns {() => void} stops it
 */
function watchTheme(callback) {
  const media = window.matchMedia('(prefers-color-scheme: dark)')
  const observer = new MutationObserver(callback)
  observer.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] })
  media.addEventListener('change', callback)
  return () => {
    observer.disconnect()
    media.removeEventListener('change', callback)
  }
}
