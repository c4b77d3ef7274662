/**
 * The page's only WebGL context, and the view that holds its canvas.
 *
 * A browser gives a page few contexts, and a reader's machine may draw without a graphics processor. So all labs draw with one
 * renderer. Its canvas stands in the view that moves: nothing is copied and nobody waits for the drawing, which goes on in the
 * browser's own process. A view at rest shows a copy on a 2-D canvas, made when the renderer's canvas moves away. When several
 * views move at once the canvas stands in none of them and each picture is copied.
 *
 * Pictures are drawn from requestAnimationFrame, and only where something changed.
 */

import { ColorManagement, LinearSRGBColorSpace, PCFShadowMap, WebGLRenderer } from 'three'
import { h } from './dom.js'

const SHARPEST = 3 // device pixels per CSS pixel
const STILL = 2 // device pixels per CSS pixel, at least, of a picture at rest without a graphics processor
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i

// MuJoCo computes with colours as they are written: no conversion to light intensities and back.
ColorManagement.enabled = false

export class Stage {
  constructor() {
    this.renderer = null
    this.views = new Set()
    this.movingViews = new Set()
    this.dirty = new Set()
    this.holder = null
    this.request = 0
    this.tick = (now) => this.paint(now)
  }

  /** Start WebGL; throws if there is none. */
  start() {
    if (this.renderer !== null) return
    const canvas = h('canvas', { class: 'lab-canvas' })
    const software = drawsInSoftware()
    this.renderer = new WebGLRenderer({ canvas, antialias: !software, alpha: true, stencil: true, powerPreference: 'low-power' })
    this.renderer.outputColorSpace = LinearSRGBColorSpace
    this.renderer.shadowMap.enabled = !software
    this.renderer.shadowMap.type = PCFShadowMap
    this.software = software
    canvas.addEventListener('webglcontextrestored', () => this.views.forEach((view) => this.invalidate(view)))
  }

  /** Device pixels per CSS pixel. Without a graphics processor moving pictures are coarse, and pictures at rest fine. */
  get sharpness() {
    const real = globalThis.devicePixelRatio || 1
    if (!this.software) return Math.min(SHARPEST, real)
    return this.movingViews.size > 0 ? 1 : Math.max(STILL, real)
  }

  add(view) {
    this.start()
    this.views.add(view)
  }

  remove(view) {
    if (this.holder === view) this.giveCanvas(null)
    for (const set of [this.views, this.movingViews, this.dirty]) set.delete(view)
    this.chooseHolder()
    if (this.views.size === 0 && this.renderer !== null) this.renderer.renderLists.dispose()
  }

  setMoving(view, isMoving) {
    if (isMoving) this.movingViews.add(view)
    else if (this.movingViews.delete(view)) this.invalidate(view) // to draw it finer
    this.chooseHolder()
  }

  /** Plan to draw the picture of a view again. */
  invalidate(view) {
    this.dirty.add(view)
    if (this.request === 0) this.request = requestAnimationFrame(this.tick)
  }

  // The canvas goes to the only view that moves, and stays with the last one that did.
  chooseHolder() {
    const next = this.movingViews.size === 0 ? this.holder : this.movingViews.size === 1 ? [...this.movingViews][0] : null
    if (next !== this.holder) this.giveCanvas(next)
  }

  giveCanvas(view) {
    const previous = this.holder
    this.holder = view
    const canvas = this.renderer.domElement
    if (previous !== null && this.views.has(previous)) {
      this.draw(previous)
      previous.copyCanvas(canvas)
    }
    if (view === null) canvas.remove()
    else {
      view.takeCanvas(canvas)
      this.draw(view)
    }
  }

  paint(now) {
    this.request = 0
    const views = [...this.dirty]
    this.dirty.clear()
    for (const view of views) {
      if (!view.prepare(now)) continue
      this.draw(view)
      if (this.holder !== view) view.copyCanvas(this.renderer.domElement)
    }
  }

  draw(view) {
    const { width, height } = view
    if (width === 0 || height === 0 || !view.scene) return
    const { renderer } = this
    if (this.width !== width || this.height !== height || this.ratio !== this.sharpness) {
      this.width = width
      this.height = height
      this.ratio = this.sharpness
      renderer.setPixelRatio(this.ratio)
      renderer.setSize(width, height, false)
    }
    // A reflection is drawn first, which also makes the shadow maps.
    renderer.shadowMap.autoUpdate = true
    renderer.shadowMap.autoUpdate = !view.reflect(this)
    renderer.render(view.scene, view.lens)
  }
}

function drawsInSoftware() {
  const gl = h('canvas').getContext('webgl2')
  if (gl === null) throw new Error('this browser has no WebGL 2')
  const info = gl.getExtension('WEBGL_debug_renderer_info')
  const name = info === null ? '' : String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL))
  gl.getExtension('WEBGL_lose_context')?.loseContext()
  return SOFTWARE.test(name)
}

/** The page's stage. */
export const stage = new Stage()
