/** The orbit camera: MuJoCo's conventions. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { OrbitCamera } from '../js/lab/page/camera.js'

const close = (a, b, tolerance = 1e-12) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < tolerance, `${a} is not ${b}`))
const camera = (fields = {}) => new OrbitCamera({ azimuth: 90, elevation: 0, distance: 2, target: [1, 2, 3], ...fields })
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0)
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

test('azimuth 90 looks along +y from behind the target; x is to the right', () => {
  const { right, up, forward } = camera().axes()
  close(forward, [0, 1, 0])
  close(right, [1, 0, 0])
  close(up, [0, 0, 1])
  close(camera().position(), [1, 0, 3])
})

test('a negative elevation looks down from above', () => {
  const down = camera({ elevation: -90 })
  close(down.axes().forward, [0, 0, -1])
  close(down.position(), [1, 2, 5])
  close(down.axes().up, [0, 1, 0])
})

test('the axes are orthonormal and right-handed everywhere, at the poles too', () => {
  for (const azimuth of [-170, -33, 0, 45, 120]) {
    for (const elevation of [-90, -89.999, -20, 0, 61, 90]) {
      const { right, up, forward } = camera({ azimuth, elevation }).axes()
      close([dot(right, right), dot(up, up), dot(forward, forward)], [1, 1, 1])
      close(
        cross(right, up),
        forward.map((x) => -x),
      )
    }
  }
})

test('half of the height of the view turns by a quarter; the elevation ends at the poles, the azimuth goes round', () => {
  const moved = camera()
  moved.rotate(0.5, 0)
  assert.equal(moved.azimuth, 0)
  moved.rotate(1.5, 0)
  assert.equal(moved.azimuth, 90 - 360)
  moved.rotate(0, 5)
  assert.equal(moved.elevation, -90)
  moved.rotate(0, -50)
  assert.equal(moved.elevation, 90)
})

test('panning by the height of the view moves the target by the height seen at its depth', () => {
  const moved = camera({ fovy: 60 })
  moved.pan(0, 1)
  close(moved.target, [1, 2, 3 + 4 * Math.tan(Math.PI / 6)])
  moved.pan(1, -1)
  close(moved.target, [1 - 4 * Math.tan(Math.PI / 6), 2, 3])
})

test('zoom multiplies the distance, within bounds, and reset goes back', () => {
  const moved = camera()
  moved.zoom(0.5)
  assert.equal(moved.distance, 1)
  moved.zoom(1e-9)
  assert.equal(moved.distance, 0.02)
  moved.zoom(1e9)
  assert.equal(moved.distance, 2000)
  moved.pan(1, 1)
  moved.reset()
  assert.deepEqual([moved.azimuth, moved.elevation, moved.distance, moved.target], [90, 0, 2, [1, 2, 3]])
})
