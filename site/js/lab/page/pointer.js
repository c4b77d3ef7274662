/**
 * Mouse, touch and keys on a view.
 *
 * Mouse as in MuJoCo's viewer: left turns, right moves, the wheel zooms, Ctrl or Shift and the left button on a body pulls it with
 * a spring, or moves the pose of a lab that is paused. If `grabs` is set, the left button or a finger alone does that. In a page the wheel belongs to the page until the view has the focus, and one finger that goes up or down scrolls.
 *
 * One finger turns, two move and zoom, and a finger that has rested on a body pulls it. Only a tap gives the view the focus, since
 * a finger that scrolls past must not capture the page's scrolling.
 */

const TURN = 6 / 180 // half turns for a press of an arrow key
const CLOSER = 0.85
const WHEEL = 0.0015 // zoom (as a logarithm) per pixel of the wheel
const LINE = 16 // pixels
const HOLD = 350 // ms that a finger rests on a body before it pulls it
const SLOP = 10 // pixels that a resting finger may move

export class Hands {
  /**
   * @param {import('./view.js').View} view
   * @param {object} actions
   * @param {(request: {body?: number, point?: number[], target: number[]} | null) => void} actions.pull
   * @param {Record<string, () => void>} actions.keys what single keys do: ' ', '.', 'r'
   */
  constructor(view, actions) {
    this.view = view
    this.actions = actions
    this.pointers = new Map()
    this.grabs = false
    this.drag = null
    this.restingFinger = null // a finger that has not moved yet: {pointer, timer}
    this.abort = new AbortController()
    const { element } = view
    const listen = (type, handler, options = {}) => element.addEventListener(type, handler, { signal: this.abort.signal, ...options })
    listen('pointerdown', (event) => this.onDown(event))
    listen('pointermove', (event) => this.onMove(event))
    listen('pointerup', (event) => this.onUp(event))
    listen('pointercancel', (event) => this.onUp(event))
    // `touch-action` cannot forbid scrolling by a finger that pulls, or by two.
    listen('touchmove', (event) => this.keepTouch(event), { passive: false })
    listen('lostpointercapture', (event) => this.onUp(event))
    listen('contextmenu', (event) => event.preventDefault())
    listen('wheel', (event) => this.onWheel(event), { passive: false })
    listen('keydown', (event) => this.onKey(event))
    listen('dblclick', () => this.resetCamera())
  }

  resetCamera() {
    this.view.camera?.reset()
    this.view.invalidate()
  }

  onDown(event) {
    const { view } = this
    if (view.camera === null || event.button > 2) return
    const touch = event.pointerType === 'touch'
    if (!touch) view.element.focus({ preventScroll: true })
    view.element.setPointerCapture(event.pointerId)
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY })
    this.cancelRest()
    this.release()
    if (this.pointers.size > 1) return
    const isMeant = this.grabs || (!touch && (event.ctrlKey || event.shiftKey || event.metaKey))
    if (event.button === 0 && isMeant) this.grab(event.pointerId)
    if (touch && this.drag === null) this.awaitRest(event)
  }

  /** Grab the body under a finger once it has rested for a while. */
  awaitRest({ pointerId }) {
    const timer = setTimeout(() => {
      this.restingFinger = null
      this.grab(pointerId)
    }, HOLD)
    this.restingFinger = { pointer: pointerId, timer }
  }

  /** The finger has moved or left. */
  cancelRest() {
    if (this.restingFinger === null) return
    clearTimeout(this.restingFinger.timer)
    this.restingFinger = null
  }

  /** Take hold of the body under a pointer. */
  grab(pointer) {
    const place = this.pointers.get(pointer)
    const hit = place === undefined ? null : this.view.pick(place.x, place.y)
    if (hit === null) return
    this.drag = { body: hit.body, point: hit.point, pointer }
    this.actions.pull({ body: hit.body, point: hit.point, target: hit.point })
  }

  /** Whether a finger that goes up or down scrolls the page, by the style. */
  pageScrolls() {
    return getComputedStyle(this.view.element).touchAction !== 'none'
  }

  keepTouch(event) {
    if (event.cancelable && (this.drag !== null || event.touches.length > 1)) event.preventDefault()
  }

  onMove(event) {
    const last = this.pointers.get(event.pointerId)
    if (last === undefined || this.view.camera === null) return
    const dx = event.clientX - last.x
    const dy = event.clientY - last.y
    if (this.restingFinger?.pointer === event.pointerId) {
      if (Math.hypot(dx, dy) < SLOP) return
      this.cancelRest()
      // The page is about to scroll; the browser cancels the pointer a little later.
      if (Math.abs(dy) > Math.abs(dx) && this.pageScrolls()) return void this.pointers.delete(event.pointerId)
    }
    if (this.drag?.pointer === event.pointerId) {
      const target = this.view.atDepth(event.clientX, event.clientY, this.drag.point)
      this.actions.pull({ body: this.drag.body, target })
    } else if (this.pointers.size === 2) this.pinch(event, last)
    else if (this.pointers.size === 1) this.orbit(dx, dy, (event.buttons & 2) !== 0 || (event.buttons & 4) !== 0)
    last.x = event.clientX
    last.y = event.clientY
    this.view.invalidate()
  }

  orbit(dx, dy, pan) {
    const { camera, height } = this.view
    if (pan) camera.pan(dx / height, dy / height)
    else camera.rotate(dx / height, dy / height)
  }

  // Two fingers: their distance zooms, their midpoint moves. Each event moves one finger, and the midpoint by half as much.
  pinch(event, last) {
    const second = [...this.pointers].find(([id]) => id !== event.pointerId)[1]
    const before = Math.hypot(last.x - second.x, last.y - second.y)
    const after = Math.hypot(event.clientX - second.x, event.clientY - second.y)
    const { camera, height } = this.view
    if (before > 0 && after > 0) camera.zoom(before / after)
    camera.pan((event.clientX - last.x) / (2 * height), (event.clientY - last.y) / (2 * height))
  }

  onUp(event) {
    if (this.restingFinger?.pointer === event.pointerId) {
      this.cancelRest()
      if (event.type === 'pointerup') this.view.element.focus({ preventScroll: true })
    }
    this.pointers.delete(event.pointerId)
    if (this.drag?.pointer === event.pointerId) this.release()
  }

  release() {
    if (this.drag === null) return
    this.drag = null
    this.actions.pull(null)
  }

  onWheel(event) {
    const { view } = this
    if (view.camera === null || !(event.ctrlKey || document.activeElement === view.element)) return
    event.preventDefault()
    const pixels = event.deltaMode === 1 ? LINE * event.deltaY : event.deltaY
    view.camera.zoom(Math.exp(WHEEL * pixels * (event.ctrlKey ? 4 : 1)))
    view.invalidate()
  }

  onKey(event) {
    const { camera } = this.view
    if (event.altKey || event.ctrlKey || event.metaKey) return
    const turn = camera && this.cameraKey(event.key, event.shiftKey, camera) // there is none before the model is loaded
    const action = turn ?? this.actions.keys[event.key.toLowerCase()]
    if (action === undefined) return
    event.preventDefault()
    action()
    this.view.invalidate()
  }

  cameraKey(key, shift, camera) {
    const turn = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN] }[key]
    if (turn) return () => (shift ? camera.pan(turn[0], turn[1]) : camera.rotate(turn[0], turn[1]))
    const zoom = { '+': CLOSER, '=': CLOSER, '-': 1 / CLOSER, _: 1 / CLOSER }[key]
    if (zoom) return () => camera.zoom(zoom)
    return key === '0' ? () => this.resetCamera() : undefined
  }

  dispose() {
    this.cancelRest()
    this.abort.abort()
  }
}
