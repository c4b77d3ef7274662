/**
 * The page's only WebGL context, and the view that holds its canvas.
 *
 * A browser gives a page few contexts, and a reader's machine may draw without a graphics processor. So all labs draw with one
 * renderer. Its canvas stands in the view that moves: nothing is copied and nobody waits for the drawing, which goes on in the
 * browser's own process. A view at rest shows a copy on a 2-D canvas, made when the renderer's canvas moves away. When several
 * views move at once the canvas stands in none of them and each picture is copied. Without a graphics processor a picture that
 * moves is deferred, so that nobody waits for it there either.
 *
 * Pictures are drawn from requestAnimationFrame, and only where something changed. Those of a view that moves are drawn coarser if they
 * are fewer than 30 a second by the median, twice; are they still fewer, the view's `rate` says how many.
 */

import {
  ColorManagement, LinearSRGBColorSpace, Mesh, OrthographicCamera, PCFShadowMap, PlaneGeometry, Scene, ShaderMaterial, WebGLRenderer,
  WebGLRenderTarget,
} from 'three' // prettier-ignore
import { h } from './dom.js'

const SHARPEST = 3 // device pixels per CSS pixel
const STILL = 2 // device pixels per CSS pixel, at least, of a picture at rest without a graphics processor
const SLOWEST = 34.5 // ms from one picture to the next, at 30 a second by a clock that is not exact
const LOOKS = 20 // pictures of which the median counts
const COARSER = 0.7 // times as many pixels across
const COARSEST = 0.5
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i

// MuJoCo computes with colours as they are written: no conversion to light intensities and back.
ColorManagement.enabled = false

export class Stage {
  constructor() {
    this.renderer = null
    this.deferred = null
    this.views = new Set()
    this.movingViews = new Set()
    this.dirty = new Set()
    this.holder = null
    this.request = 0
    this.tick = (now) => this.paint(now)
    this.setPace()
  }

  /** Forget how fast pictures were drawn, and how coarsely. */
  setPace() {
    this.scale = 1
    this.began = NaN // when the last picture was begun, unless nothing waited for its end
    this.spans = []
    if (this.holder) this.holder.rate = Infinity
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
    if (software) this.deferred = new DeferredPicture(this.renderer)
    canvas.addEventListener('webglcontextrestored', () => this.views.forEach((view) => this.invalidate(view)))
  }

  /** Device pixels per CSS pixel. Without a graphics processor moving pictures are coarse, and pictures at rest fine. */
  get sharpness() {
    const real = globalThis.devicePixelRatio || 1
    const isMoving = this.movingViews.size > 0
    if (this.software) return isMoving ? this.scale : Math.max(STILL, real)
    return Math.min(SHARPEST, real) * (isMoving ? this.scale : 1)
  }

  add(view) {
    this.start()
    this.views.add(view)
    this.setPace()
  }

  remove(view) {
    if (this.holder === view) this.giveCanvas(null)
    for (const set of [this.views, this.movingViews, this.dirty]) set.delete(view)
    this.chooseHolder()
    if (this.views.size === 0 && this.renderer !== null) this.renderer.renderLists.dispose()
  }

  setMoving(view, isMoving) {
    if (isMoving && this.movingViews.size === 0) this.setPace() // what was slow may be fast by now
    if (isMoving) this.movingViews.add(view)
    else if (this.movingViews.delete(view)) this.invalidate(view) // to draw it finer
    this.chooseHolder()
  }

  /** Plan to draw the picture of a view again. */
  invalidate(view) {
    this.dirty.add(view)
    this.plan()
  }

  plan() {
    if (this.request === 0) this.request = requestAnimationFrame(this.tick)
  }

  // The canvas goes to the only view that moves, and stays with the last one that did.
  chooseHolder() {
    const next = this.movingViews.size === 0 ? this.holder : this.movingViews.size === 1 ? [...this.movingViews][0] : null
    if (next !== this.holder) this.giveCanvas(next)
  }

  giveCanvas(view) {
    const previous = this.holder
    this.setPace()
    this.holder = view
    const canvas = this.renderer.domElement
    if (previous !== null && this.views.has(previous)) {
      this.draw(previous)
      previous.copyCanvas(canvas)
    }
    canvas.remove()
    if (view === null) return
    if (this.deferred === null) this.show(view)
    else this.invalidate(view)
  }

  paint(now) {
    this.request = 0
    if (this.deferred?.view) {
      this.finishDeferred()
      return
    }
    const { holder, dirty } = this
    const others = [...dirty].filter((view) => view !== holder && view.prepare(now))
    // Drawing the others changes the canvas.
    const isHolderDue = holder !== null && (others.length > 0 || dirty.has(holder)) && holder.prepare(now)
    dirty.clear()
    for (const view of others) this.show(view)
    const isAlone = isHolderDue && others.length === 0 && this.movingViews.size > 0
    this.keepPace(isAlone ? now : NaN)
    if (isAlone) this.plan() // to see whether the next one waits for it
    if (isAlone && this.deferred !== null) this.deferred.begin(holder, this.sharpness, () => this.render(holder))
    else if (isHolderDue) this.show(holder)
  }

  /** Note that a picture is begun as soon as the one before allows, at a time (ms); NaN: that none is. */
  keepPace(now) {
    const span = now - this.began
    this.began = now
    if (Number.isNaN(span) || this.spans.push(span) < LOOKS) return
    const median = this.spans.sort((a, b) => a - b)[LOOKS / 2]
    this.spans = []
    const isSlow = median > SLOWEST
    this.holder.rate = isSlow && this.scale <= COARSEST ? 1000 / median : Infinity
    if (isSlow && this.scale > COARSEST) this.scale *= COARSER
  }

  finishDeferred() {
    const { deferred, holder } = this
    this.plan()
    if (!deferred.isFinished) return
    if (deferred.view !== holder || holder.width === 0 || holder.height === 0) deferred.drop()
    else {
      this.fit(holder)
      deferred.copy()
      this.place(holder)
    }
  }

  /** Draw the picture of a view and put it there. */
  show(view) {
    this.draw(view)
    this.place(view)
  }

  place(view) {
    const canvas = this.renderer.domElement
    if (this.holder !== view) view.copyCanvas(canvas)
    else if (canvas.parentNode !== view.element) view.takeCanvas(canvas)
  }

  draw(view) {
    if (view.width === 0 || view.height === 0 || !view.scene) return
    this.fit(view)
    this.render(view)
  }

  /** Give the canvas the size of a view. */
  fit({ width, height }) {
    if (this.width === width && this.height === height && this.ratio === this.sharpness) return
    this.width = width
    this.height = height
    this.ratio = this.sharpness
    this.renderer.setPixelRatio(this.ratio)
    this.renderer.setSize(width, height, false)
  }

  render(view) {
    const { renderer } = this
    // A reflection is drawn first, which also makes the shadow maps.
    renderer.shadowMap.autoUpdate = true
    renderer.shadowMap.autoUpdate = !view.reflect(this)
    renderer.render(view.scene, view.lens)
  }
}

/**
 * The next picture of a canvas, drawn without a graphics processor.
 *
 * A browser without one reads the canvas back whenever the page changes, and the page waits until all of it is drawn. So a picture
 * is drawn into a texture, which takes long and nobody waits for, and then copied to the canvas, which takes a moment.
 */
class DeferredPicture {
  /** @param {import('three').WebGLRenderer} renderer that of the canvas */
  constructor(renderer) {
    this.renderer = renderer
    this.view = null // whose picture is being drawn
    this.fence = null // tells when it is
    this.target = new WebGLRenderTarget(1, 1, { stencilBuffer: true })
    this.scene = new Scene().add(sheet(this.target.texture))
    this.lens = new OrthographicCamera()
  }

  /** Begin the picture of a view, with `sharpness` device pixels per CSS pixel, by calling `render`. */
  begin(view, sharpness, render) {
    const { renderer, target } = this
    target.setSize(Math.floor(view.width * sharpness), Math.floor(view.height * sharpness))
    renderer.setRenderTarget(target)
    render()
    renderer.setRenderTarget(null)
    const gl = renderer.getContext()
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)
    gl.flush()
    this.view = view
  }

  /** Whether the picture is drawn, or never will be: a context that is lost has no fence. */
  get isFinished() {
    const gl = this.renderer.getContext()
    return this.fence === null || gl.clientWaitSync(this.fence, 0, 0) !== gl.TIMEOUT_EXPIRED
  }

  /** Copy the picture to the canvas, which is of its size. */
  copy() {
    this.drop()
    this.renderer.render(this.scene, this.lens)
  }

  /** Forget the picture, whose view has lost the canvas. */
  drop() {
    this.renderer.getContext().deleteSync(this.fence)
    this.view = this.fence = null
  }
}

/** What fills a canvas with a picture. */
function sheet(picture) {
  const vertexShader = 'varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }'
  const fragmentShader = 'uniform sampler2D picture; varying vec2 place; void main() { gl_FragColor = texture2D(picture, place); }'
  const uniforms = { picture: { value: picture } }
  const material = new ShaderMaterial({ vertexShader, fragmentShader, uniforms, depthTest: false, depthWrite: false })
  const mesh = new Mesh(new PlaneGeometry(2, 2), material)
  mesh.frustumCulled = false
  return mesh
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
