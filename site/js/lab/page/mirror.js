/**
 * The reflection in a shiny floor; a picture has one at most.
 *
 * As in MuJoCo's renderer, the first opaque plane or box with `reflectance` reflects: a plane on its upper side, a box on the face
 * towards its +z. The reflection is added to its own colour, times `reflectance`; it does not show the sky.
 *
 * The scene is drawn a second time from the eye's mirror image, into a texture that the surface looks up by its place on the
 * screen. A scene without such a geom has no `Mirror`.
 */

import { Matrix4, PerspectiveCamera, Vector2, Vector3, Vector4, WebGLRenderTarget } from 'three'
import { GEOM } from './geometry.js'
import { extend } from './materials.js'

const SOFT = 0.5 // texels for each pixel, without a graphics processor

export class Mirror {
  /** @param {{solid: import('./solid.js').Solid, reflectance: number}[]} surfaces that may reflect, in the model's order */
  constructor(surfaces) {
    this.lens = new PerspectiveCamera()
    this.lens.matrixAutoUpdate = false
    this.target = null
    this.picture = { value: null }
    this.screen = { value: new Vector2() }
    this.surfaces = surfaces.map(({ solid, reflectance }) => {
      const strength = { value: 0 }
      addReflection(solid.material, { labMirror: this.picture, labScreen: this.screen, labReflectance: strength })
      return { solid, reflectance, strength }
    })
  }

  /** Draw the reflection for the next picture through `lens`; returns whether there is one. */
  draw({ renderer, software, sharpness }, scene, lens, width, height) {
    this.picture.value = null
    for (const { strength } of this.surfaces) strength.value = 0
    const surface = this.surfaces.find(({ solid }) => solid.isVisible && !solid.material.transparent)
    const plane = surface === undefined ? null : upperFace(surface.solid)
    if (plane === null || !reflect(lens, plane, this.lens)) return false
    this.resize(sharpness * (software ? SOFT : 1), width, height)
    this.render(renderer, scene, surface.solid.material)
    this.picture.value = this.target.texture
    this.screen.value.set(1 / (width * sharpness), 1 / (height * sharpness))
    surface.strength.value = surface.reflectance
    return true
  }

  resize(scale, width, height) {
    const [w, h] = [width, height].map((x) => Math.max(1, Math.round(scale * x)))
    // Without antialiasing: resolving it would lose the shadow maps of point lights, which the picture still needs.
    this.target ??= new WebGLRenderTarget(w, h)
    this.target.setSize(w, h)
  }

  render(renderer, scene, material) {
    const { background } = scene
    scene.background = null
    // The surface itself is not in its reflection, but it may cast a shadow there.
    material.colorWrite = material.depthWrite = false
    const picture = renderer.getRenderTarget()
    renderer.setRenderTarget(this.target)
    renderer.render(scene, this.lens)
    renderer.setRenderTarget(picture)
    material.colorWrite = material.depthWrite = true
    scene.background = background
  }

  dispose() {
    this.target?.dispose()
  }
}

/** The reflecting surface, as a point on it and its normal; null if it has no size. */
function upperFace({ type, meshes: [mesh] }) {
  const e = mesh.matrix.elements
  const normal = new Vector3(e[8], e[9], e[10])
  const point = new Vector3(e[12], e[13], e[14])
  if (type === GEOM.BOX) point.add(normal)
  return normal.lengthSq() > 0 ? { point, normal: normal.normalize() } : null
}

/**
 * Set `mirrored` to a camera that sees what a plane reflects to `lens`, with left and right exchanged.
 *
 * Its near plane is laid into the mirror, which cuts off what is behind it.
 *
 * @returns {boolean} false where the eye is behind the plane
 */
export function reflect(lens, { point, normal }, mirrored) {
  const eye = new Vector3().setFromMatrixPosition(lens.matrixWorld)
  const offset = normal.dot(point)
  if (normal.dot(eye) <= offset) return false
  const { x, y, z } = normal
  const householder = new Matrix4().set(
    1 - 2 * x * x, -2 * x * y, -2 * x * z, 2 * offset * x,
    -2 * x * y, 1 - 2 * y * y, -2 * y * z, 2 * offset * y,
    -2 * x * z, -2 * y * z, 1 - 2 * z * z, 2 * offset * z,
    0, 0, 0, 1,
  ) // prettier-ignore
  // Exchanging left and right makes it a rotation again, so that front faces stay front faces.
  mirrored.matrix.multiplyMatrices(householder, lens.matrixWorld).scale(new Vector3(-1, 1, 1))
  mirrored.updateMatrixWorld(true)
  mirrored.projectionMatrix.copy(lens.projectionMatrix)
  mirrored.projectionMatrixInverse.copy(lens.projectionMatrixInverse)
  clipFrustum(mirrored, normal, point)
  return true
}

/** Lay the near plane of a camera into a plane, and its far plane through the farthest corner of the frustum. */
function clipFrustum(camera, normal, point) {
  const inverse = camera.matrixWorldInverse
  const n = normal.clone().transformDirection(inverse)
  const plane = new Vector4(n.x, n.y, n.z, -n.dot(point.clone().applyMatrix4(inverse)))
  const corner = new Vector4(Math.sign(plane.x), Math.sign(plane.y), 1, 1).applyMatrix4(camera.projectionMatrixInverse)
  const e = camera.projectionMatrix.elements
  const w = new Vector4(e[3], e[7], e[11], e[15])
  plane.multiplyScalar((2 * w.dot(corner)) / plane.dot(corner)).sub(w)
  e[2] = plane.x
  e[6] = plane.y
  e[10] = plane.z
  e[14] = plane.w
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert()
}

/** Let a material add the reflection where its normal is the geom's z axis. */
function addReflection(material, uniforms) {
  const { onBeforeCompile } = material
  const name = `${material.userData.shader ?? ''} lab-mirror`
  material.onBeforeCompile = (shader, renderer) => {
    onBeforeCompile.call(material, shader, renderer)
    Object.assign(shader.uniforms, uniforms)
    extend(shader, {
      vertexShader: { common: 'varying float vLabTop;', begin_vertex: 'vLabTop = step(0.5, normal.z);' },
      fragmentShader: {
        common: 'varying float vLabTop; uniform sampler2D labMirror; uniform vec2 labScreen; uniform float labReflectance;',
        opaque_fragment: `
          vec2 labAt = gl_FragCoord.xy * labScreen;
          gl_FragColor.rgb += labReflectance * vLabTop * texture2D(labMirror, vec2(1.0 - labAt.x, labAt.y)).rgb;`,
      },
    })
  }
  material.customProgramCacheKey = () => name
}
