/**
 * Hands on a view: mouse, touch and keys.
 *
 * Mouse as in MuJoCo's viewer: left turns, right moves, the wheel zooms, Ctrl or Shift and the left button on a body pulls it with
 * a spring. In a page the wheel belongs to the page until the view has the focus, and one finger that goes up or down scrolls.
 *
 * One finger turns, two move and zoom, and a finger that has rested on a body pulls it. Only a tap gives the view the focus: a
 * finger that scrolled past would else have locked the page behind it.
 */

const TURN = 6 / 180 // of a half turn, for a press of an arrow key
const CLOSER = 0.85
const WHEEL = 0.0015 // of zoom for a pixel of the wheel
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
    this.pulled = null
    this.resting = null // a finger that has not moved yet: {pointer, timer}
    this.abort = new AbortController()
    const { element } = view
    const on = (type, handler, options = {}) => element.addEventListener(type, handler, { signal: this.abort.signal, ...options })
    on('pointerdown', (event) => this.down(event))
    on('pointermove', (event) => this.move(event))
    on('pointerup', (event) => this.up(event))
    on('pointercancel', (event) => this.up(event))
    // What `touch-action` leaves to the page: no scrolling by a finger that pulls, nor by two.
    on('touchmove', (event) => this.keepTouch(event), { passive: false })
    on('lostpointercapture', (event) => this.up(event))
    on('contextmenu', (event) => event.preventDefault())
    on('wheel', (event) => this.wheel(event), { passive: false })
    on('keydown', (event) => this.key(event))
    on('dblclick', () => this.home())
  }

  home() {
    this.view.camera?.reset()
    this.view.invalidate()
  }

  down(event) {
    const { view } = this
    if (view.camera === null || event.button > 2) return
    const touch = event.pointerType === 'touch'
    if (!touch) view.element.focus({ preventScroll: true })
    view.element.setPointerCapture(event.pointerId)
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY })
    this.rouse()
    this.release()
    if (this.pointers.size > 1) return
    if (touch) this.rest(event)
    else if (event.button === 0 && (event.ctrlKey || event.shiftKey || event.metaKey)) this.grab(event.pointerId)
  }

  /** Wait whether a finger stays where it is. */
  rest({ pointerId }) {
    const timer = setTimeout(() => {
      this.resting = null
      this.grab(pointerId)
    }, HOLD)
    this.resting = { pointer: pointerId, timer }
  }

  /** It does not. */
  rouse() {
    if (this.resting === null) return
    clearTimeout(this.resting.timer)
    this.resting = null
  }

  /** Take hold of the body under a pointer. */
  grab(pointer) {
    const place = this.pointers.get(pointer)
    const hit = place === undefined ? null : this.view.pick(place.x, place.y)
    if (hit === null) return
    this.pulled = { body: hit.body, point: hit.point, pointer }
    this.actions.pull({ body: hit.body, point: hit.point, target: hit.point })
  }

  /** Whether a finger that goes up or down belongs to the page; the style says so. */
  scrolls() {
    return getComputedStyle(this.view.element).touchAction !== 'none'
  }

  keepTouch(event) {
    if (event.cancelable && (this.pulled !== null || event.touches.length > 1)) event.preventDefault()
  }

  move(event) {
    const last = this.pointers.get(event.pointerId)
    if (last === undefined || this.view.camera === null) return
    const dx = event.clientX - last.x
    const dy = event.clientY - last.y
    if (this.resting?.pointer === event.pointerId) {
      if (Math.hypot(dx, dy) < SLOP) return
      this.rouse()
      // The page is about to scroll, which the browser tells a little later.
      if (Math.abs(dy) > Math.abs(dx) && this.scrolls()) return void this.pointers.delete(event.pointerId)
    }
    if (this.pulled?.pointer === event.pointerId) {
      const target = this.view.atDepth(event.clientX, event.clientY, this.pulled.point)
      this.actions.pull({ body: this.pulled.body, target })
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

  // Two fingers: their distance zooms, their middle moves. Each event brings one finger, half of the movement of the middle.
  pinch(event, last) {
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1]
    const before = Math.hypot(last.x - other.x, last.y - other.y)
    const after = Math.hypot(event.clientX - other.x, event.clientY - other.y)
    const { camera, height } = this.view
    if (before > 0 && after > 0) camera.zoom(before / after)
    camera.pan((event.clientX - last.x) / (2 * height), (event.clientY - last.y) / (2 * height))
  }

  up(event) {
    if (this.resting?.pointer === event.pointerId) {
      this.rouse()
      if (event.type === 'pointerup') this.view.element.focus({ preventScroll: true })
    }
    this.pointers.delete(event.pointerId)
    if (this.pulled?.pointer === event.pointerId) this.release()
  }

  release() {
    if (this.pulled === null) return
    this.pulled = null
    this.actions.pull(null)
  }

  wheel(event) {
    const { view } = this
    if (view.camera === null || !(event.ctrlKey || document.activeElement === view.element)) return
    event.preventDefault()
    const pixels = event.deltaMode === 1 ? LINE * event.deltaY : event.deltaY
    view.camera.zoom(Math.exp(WHEEL * pixels * (event.ctrlKey ? 4 : 1)))
    view.invalidate()
  }

  key(event) {
    const { camera } = this.view
    if (camera === null || event.altKey || event.ctrlKey || event.metaKey) return
    const action = this.cameraKey(event.key, event.shiftKey, camera) ?? this.actions.keys[event.key.toLowerCase()]
    if (action === undefined) return
    event.preventDefault()
    action()
    this.view.invalidate()
  }

  cameraKey(key, shift, camera) {
    const step = (dx, dy) => () => (shift ? camera.pan(dx, dy) : camera.rotate(dx, dy))
    switch (key) {
      case 'ArrowLeft':
        return step(-TURN, 0)
      case 'ArrowRight':
        return step(TURN, 0)
      case 'ArrowUp':
        return step(0, -TURN)
      case 'ArrowDown':
        return step(0, TURN)
      case '+':
      case '=':
        return () => camera.zoom(CLOSER)
      case '-':
      case '_':
        return () => camera.zoom(1 / CLOSER)
      case '0':
        return () => this.home()
      default:
        return undefined
    }
  }

  dispose() {
    this.rouse()
    this.abort.abort()
  }
}
