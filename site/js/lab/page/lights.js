/**
 * The lights of a lab.
 *
 * A model with lights has those and MuJoCo's headlight, as in MuJoCo. A model without is lit like the recorded picture, from the
 * camera and from above, as the headlight alone would leave it too dark.
 */

import { AmbientLight, DirectionalLight, PointLight, SpotLight } from 'three'

const FULL = Math.PI // see materials.js
const AMBIENT = 0.35
const FROM_CAMERA = 0.25
const FROM_ABOVE = 0.6 // the largest part, so that no two sides of a box look alike
export const ABOVE = [0.25, -0.35, 0.9]
const LIGHT = 7 // floats in a frame
const SPOT = 0 // mjtLightType
const DIRECTIONAL = 1
const SHADOW_TEXELS = 1024
const SHADOW_PASSES = 8 // the most passes for shadows in one picture
const ALL_AROUND = 6 // passes for a point light

/** The light from all sides, as red, green and blue. */
export function ambientOf({ lights, visual: { headlight } }) {
  if (lights.length === 0) return [AMBIENT, AMBIENT, AMBIENT]
  const sources = headlight.active ? [...lights, headlight] : lights
  return [0, 1, 2].map((i) => sources.reduce((sum, light) => sum + light.ambient[i], 0))
}

export class Lights {
  /** @param {any} description of the lab's scene; @param {import('three').Scene} scene */
  constructor(description, scene) {
    this.scene = scene
    this.extent = description.extent
    this.center = description.center
    this.start = description.layout.lights
    this.shadows = 0
    this.ambient = new AmbientLight(0xffffff, FULL)
    this.ambient.color.setRGB(...ambientOf(description))
    this.head = new DirectionalLight(0xffffff, FULL * FROM_CAMERA)
    this.lights = description.lights.map((light) => this.makeLight(light))
    this.add(this.head)
    scene.add(this.ambient)
    if (this.lights.length === 0) this.addTopLight()
    else this.setHeadlight(description)
  }

  addTopLight() {
    const topLight = new DirectionalLight(0xffffff, FULL * FROM_ABOVE)
    topLight.position
      .set(...ABOVE)
      .multiplyScalar(4 * this.extent)
      .add({ x: this.center[0], y: this.center[1], z: this.center[2] })
    topLight.target.position.set(...this.center)
    this.add(topLight)
    topLight.target.updateMatrixWorld()
  }

  setHeadlight({ visual: { headlight } }) {
    this.head.visible = headlight.active
    this.head.color.setRGB(...headlight.diffuse)
    this.head.intensity = FULL
  }

  makeLight(info) {
    const light =
      info.type === DIRECTIONAL
        ? new DirectionalLight()
        : info.type === SPOT && info.cutoff < 90
          ? new SpotLight(0xffffff, 1, 0, (info.cutoff * Math.PI) / 180, Math.min(1, 8 / Math.max(8, info.exponent)), 0)
          : new PointLight(0xffffff, 1, 0, 0)
    light.color.setRGB(...info.diffuse)
    light.intensity = FULL
    if (info.castshadow) this.addShadow(light)
    this.add(light)
    return light
  }

  // MuJoCo gives a spot light of any width one shadow map, and a point light no light at all; here a wide spot light and a point light
  // shine and cast shadows in all directions. Only the first lights cast shadows, as each pass draws the whole model.
  addShadow(light) {
    const passes = light.isPointLight ? ALL_AROUND : 1
    if (this.shadows + passes > SHADOW_PASSES) return
    this.shadows += passes
    light.castShadow = true
    const texels = light.isPointLight ? SHADOW_TEXELS / 2 : SHADOW_TEXELS
    light.shadow.mapSize.set(texels, texels)
    light.shadow.normalBias = 0.004 * this.extent
    const { camera } = light.shadow
    camera.near = 0.01 * this.extent
    camera.far = 20 * this.extent
    const side = 1.5 * this.extent
    if (camera.isOrthographicCamera) Object.assign(camera, { left: -side, right: side, bottom: -side, top: side })
    camera.updateProjectionMatrix()
  }

  add(light) {
    this.scene.add(light)
    if (light.target) this.scene.add(light.target)
  }

  /** Move the lights to their places in a frame, and the headlight to the camera. */
  update(frame, eye, forward) {
    this.head.position.set(...eye)
    this.head.target.position.set(eye[0] + forward[0], eye[1] + forward[1], eye[2] + forward[2])
    this.lights.forEach((light, i) => {
      const offset = this.start + LIGHT * i
      const [px, py, pz, dx, dy, dz, isOn] = frame.subarray(offset, offset + LIGHT)
      light.visible = isOn !== 0
      light.position.set(px, py, pz)
      if (light.isDirectionalLight) light.position.set(...this.center.map((x, j) => x - 4 * this.extent * [dx, dy, dz][j]))
      const { x, y, z } = light.position
      light.target?.position.set(x + dx, y + dy, z + dz)
    })
  }

  dispose() {
    for (const light of this.lights) light.dispose()
  }
}
