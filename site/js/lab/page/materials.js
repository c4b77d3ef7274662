/**
 * MuJoCo's materials and textures for three.js.
 *
 * MuJoCo lights as OpenGL's fixed pipeline does, with colours as they are written; three.js with light intensities, in which a
 * surface of colour c returns c/π. Lights are therefore π times as strong here, and specular colours divided by what
 * three.js's highlight has more than OpenGL's.
 *
 * `metallic` and `roughness`, which MuJoCo's own renderer knows but does not draw, are unset below 0. Where one of them is set, they take
 * the place of `specular` and `shininess` (see `finishOf`).
 */

import {
  CubeTexture, DataTexture, DoubleSide, LinearFilter, LinearMipmapLinearFilter, MeshPhongMaterial,
  NoColorSpace, RepeatWrapping, RGBAFormat,
} from 'three' // prettier-ignore
import { ambientOf } from './lights.js'

const SPECULAR = 0.5 // of a geom without a material
const SHININESS = 0.5
const WITHOUT_LIGHTS = 0.5 // see lights.js
const FINE = 4 // anisotropy
const DIELECTRIC = 0.04 // what a surface that is no metal reflects of light from straight ahead
const ROOM = 0.5 // of a metal's light is that of the room that it mirrors, lit as a matte surface is
const SHARPEST = 1024 // exponent of a highlight
const TEXTURE_CUBE = 1
const TEXTURE_SKY = 2

export class Materials {
  /** @param {object} scene the description of a lab's scene */
  constructor(scene) {
    this.scene = scene
    this.textures = new Map()
    this.made = []
    this.gloss = gloss(scene)
    this.ambient = ambientOf(scene)
  }

  /**
   * A material of its own for one geom, since its colour may change.
   *
   * @param {number} id of the material, or -1
   */
  make(id, { doubleSided = false } = {}) {
    const info = this.scene.materials[id]
    const { shininess, specular, metallic } = finishOf(info, this.gloss)
    const material = new MeshPhongMaterial({ shininess })
    material.specular.setScalar(specular)
    Object.assign(material.userData, { emission: info?.emission ?? 0, metallic, specular })
    if (doubleSided) material.side = DoubleSide
    this.made.push(material)
    return material
  }

  /** Colour and transparency (red, green, blue, alpha in [0, 1]) from the frame. */
  paint(material, r, g, b, a, emission = material.userData.emission) {
    const old = material.userData
    if (old.r === r && old.g === g && old.b === b && old.a === a && old.emission === emission) return
    Object.assign(old, { r, g, b, a, emission })
    const { metallic, specular } = old
    const matte = 1 - (1 - ROOM) * metallic
    material.color.setRGB(r, g, b).multiplyScalar(matte)
    material.emissive.setRGB(r, g, b).multiplyScalar(emission)
    if (metallic > 0) {
      // A metal has no colour but in what it mirrors: lights, what comes from all sides, and a room that is not there. Without the
      // last it would be black wherever no light is mirrored.
      const mirrored = (colour, i) => specular * (1 - metallic) + metallic * colour[i]
      const all = [r, g, b]
      material.specular.setRGB(mirrored(all, 0), mirrored(all, 1), mirrored(all, 2))
      material.emissive.setRGB(...all.map((x, i) => x * (emission + (1 - matte) * this.ambient[i])))
    }
    const through = a < 1
    if (material.transparent !== through) {
      material.transparent = through
      material.depthWrite = !through
      material.needsUpdate = true
    }
    material.opacity = a
  }

  /**
   * Give a material its texture.
   *
   * @param {boolean} wrapped whether the geometry has texture coordinates of a file
   * @returns {((size: ArrayLike<number>, x?: number, y?: number, endless?: boolean) => void) | null} what to call when the size, which
   *   is the visualizer's, has changed; x and y are where in its plane (m) an endless plane has its middle
   */
  dress(material, id, wrapped) {
    const info = this.scene.materials[id]
    const texture = info === undefined ? undefined : this.scene.textures[info.texture]
    if (texture === undefined || texture.type === TEXTURE_SKY) return null
    if (texture.type === TEXTURE_CUBE) return wrapCube(material, this.cube(info.texture), info.texuniform)
    const map = this.flat(info.texture).clone()
    map.needsUpdate = true
    material.map = map
    // OpenGL's textures colour all of the light, and so what a surface sends out by itself.
    if (info.emission > 0 || info.metallic > 0) material.emissiveMap = map
    this.made.push(map)
    const [u, v] = info.texrepeat
    if (wrapped) {
      map.repeat.set(u, v)
      return null
    }
    // A uniform texture is repeated for every metre of two, another as often on each face. That of an endless plane is uniform.
    return (size, x = 0, y = 0, endless = false) => {
      const uniform = info.texuniform || endless
      map.repeat.set(uniform ? u * size[0] : u, uniform ? v * size[1] : v)
      if (endless) map.offset.set((u * (x - size[0]) + 1) / 2, (1 - v * (y + size[1])) / 2)
    }
  }

  flat(id) {
    if (!this.textures.has(id)) {
      const { width, height } = this.scene.textures[id]
      this.textures.set(id, finish(new DataTexture(rgba(this.scene.textures[id], 0, height), width, height, RGBAFormat)))
    }
    return this.textures.get(id)
  }

  /** Six faces: +x, -x, +y, -y, +z, -z, one above the other; a square texture is on all of them. */
  cube(id) {
    if (!this.textures.has(id)) {
      const texture = this.scene.textures[id]
      const { width, height } = texture
      const faces = Array.from({ length: 6 }, (_, i) => {
        const from = height === 6 * width ? i * width : 0
        return new DataTexture(rgba(texture, from, width), width, width, RGBAFormat)
      })
      faces.forEach((face) => (face.needsUpdate = true))
      this.textures.set(id, finish(new CubeTexture(faces)))
    }
    return this.textures.get(id)
  }

  /** The texture of the sky, or null. */
  sky() {
    const id = this.scene.textures.findIndex((texture) => texture.type === TEXTURE_SKY)
    return id < 0 ? null : this.cube(id)
  }

  dispose() {
    for (const thing of [...this.made, ...this.textures.values()]) thing.dispose()
  }
}

/**
 * How a material of MuJoCo takes light: exponent and strength of three.js's highlight, and how much it is of metal.
 *
 * A surface that is rough on a small scale, with slopes of spread `roughness`², has about the highlight of the exponent 2/roughness⁴ - 2.
 *
 * @param {object | undefined} info @param {number} gloss how much weaker highlights are because of their lights
 */
export function finishOf(info, gloss) {
  const { shininess = SHININESS, specular = SPECULAR, metallic = -1, roughness = -1 } = info ?? {}
  const exponent = Math.max(1, 128 * shininess)
  if (metallic < 0 && roughness < 0) return { shininess: exponent, specular: (8 / (exponent + 2)) * specular * gloss, metallic: 0 }
  const rough = 2 / Math.max(roughness, 1e-3) ** 4 - 2
  return {
    shininess: roughness < 0 ? exponent : Math.min(SHARPEST, Math.max(1, rough)),
    specular: DIELECTRIC,
    metallic: Math.min(1, Math.max(0, metallic)),
  }
}

/** Highlights have the light's specular colour in MuJoCo, its only colour in three.js: how much weaker they are. */
function gloss({ lights, visual: { headlight } }) {
  if (lights.length === 0) return WITHOUT_LIGHTS
  const all = headlight.active ? [...lights, headlight] : lights
  const sum = (name) => all.reduce((total, light) => total + light[name][0] + light[name][1] + light[name][2], 0)
  return sum('diffuse') > 0 ? Math.min(2, sum('specular') / sum('diffuse')) : 0
}

function finish(texture) {
  texture.colorSpace = NoColorSpace
  texture.wrapS = texture.wrapT = RepeatWrapping
  texture.magFilter = LinearFilter
  texture.minFilter = LinearMipmapLinearFilter
  texture.generateMipmaps = true
  texture.anisotropy = FINE
  texture.needsUpdate = true
  return texture
}

/** Rows of a texture as red, green, blue, alpha. */
function rgba({ width, channels, data }, firstRow, rows) {
  const count = width * rows
  const target = new Uint8Array(4 * count)
  for (let i = 0, from = firstRow * width * channels; i < count; i++, from += channels) {
    const grey = channels < 3
    target[4 * i] = data[from]
    target[4 * i + 1] = data[from + (grey ? 0 : 1)]
    target[4 * i + 2] = data[from + (grey ? 0 : 2)]
    target[4 * i + 3] = channels === 4 ? data[from + 3] : 255
  }
  return target
}

/** A cube texture is looked up by the direction from the geom's centre, in its own axes: of the unit shape, or if `uniform` of the geom. */
function wrapCube(material, texture, uniform) {
  const size = { value: [1, 1, 1] }
  material.onBeforeCompile = (shader) => {
    shader.uniforms.labCube = { value: texture }
    shader.uniforms.labSize = size
    shader.vertexShader = shader.vertexShader
      .replace(
        '#include <common>',
        '#include <common>\nattribute vec3 direction;\nvarying vec3 vLabDirection;\nuniform vec3 labSize;',
      )
      .replace('#include <begin_vertex>', '#include <begin_vertex>\nvLabDirection = direction * labSize;')
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', '#include <common>\nvarying vec3 vLabDirection;\nuniform samplerCube labCube;')
      .replace(
        '#include <map_fragment>',
        'vec4 labTexel = textureCube(labCube, vLabDirection);\ndiffuseColor *= labTexel;\ntotalEmissiveRadiance *= labTexel.rgb;',
      )
  }
  material.userData.shader = 'lab-cube'
  material.customProgramCacheKey = () => 'lab-cube'
  return (now) => {
    if (uniform) size.value = [now[0], now[1], now[2]]
  }
}
