/**
 * MuJoCo's materials and textures for three.js.
 *
 * MuJoCo lights like OpenGL's fixed pipeline, with colours as they are written; three.js with light intensities, of which a
 * surface of colour c returns c/π. Therefore lights are π times as strong here, and specular colours are divided by the ratio of
 * three.js's highlight to OpenGL's.
 *
 * `metallic` and `roughness`, which MuJoCo's own renderer ignores, are unset if negative. If one of them is set, they replace
 * `specular` and `shininess` (see `finishOf`).
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
const DIELECTRIC = 0.04 // reflectance of a non-metal at normal incidence
const ROOM = 0.5 // part of a metal's light that comes from an imagined room, lit like a matte surface
const SHARPEST = 1024 // exponent of a highlight
const TEXTURE_CUBE = 1
const TEXTURE_SKY = 2

export class Materials {
  /** @param {any} scene the description of a lab's scene */
  constructor(scene) {
    this.scene = scene
    this.textures = new Map()
    this.resources = []
    this.gloss = glossOf(scene)
    this.ambient = ambientOf(scene)
  }

  /**
   * A material of its own for one geom, since its colour may change.
   *
   * @param {number} id of the material, or -1
   */
  makeMaterial(id, { doubleSided = false } = {}) {
    const info = this.scene.materials[id]
    const { shininess, specular, metallic } = finishOf(info, this.gloss)
    const material = new MeshPhongMaterial({ shininess })
    material.specular.setScalar(specular)
    Object.assign(material.userData, { emission: info?.emission ?? 0, metallic, specular })
    if (doubleSided) material.side = DoubleSide
    this.resources.push(material)
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
      // A metal has colour only in its reflections: of lights, of the ambient light, and of an imagined room, without which it
      // would be black wherever it reflects no light.
      const mirrored = (colour, i) => specular * (1 - metallic) + metallic * colour[i]
      const rgb = [r, g, b]
      material.specular.setRGB(mirrored(rgb, 0), mirrored(rgb, 1), mirrored(rgb, 2))
      material.emissive.setRGB(...rgb.map((x, i) => x * (emission + (1 - matte) * this.ambient[i])))
    }
    const isTransparent = a < 1
    if (material.transparent !== isTransparent) {
      material.transparent = isTransparent
      material.depthWrite = !isTransparent
      material.needsUpdate = true
    }
    material.opacity = a
  }

  /**
   * Give a material its texture.
   *
   * @param {boolean} wrapped whether the geometry has texture coordinates of a file
   * @returns {((size: ArrayLike<number>, x?: number, y?: number, endless?: boolean) => void) | null} to be called when the size (as the
   *   visualizer has it) has changed; x and y are the centre of an endless plane in its own coordinates (m)
   */
  applyTexture(material, id, wrapped) {
    const info = this.scene.materials[id]
    const texture = info === undefined ? undefined : this.scene.textures[info.texture]
    if (texture === undefined || texture.type === TEXTURE_SKY) return null
    if (texture.type === TEXTURE_CUBE) return wrapCube(material, this.cube(info.texture), info.texuniform)
    const map = this.flat(info.texture).clone()
    map.needsUpdate = true
    material.map = map
    // OpenGL's textures colour all light, also what a surface emits.
    if (info.emission > 0 || info.metallic > 0) material.emissiveMap = map
    this.resources.push(map)
    const [u, v] = info.texrepeat
    if (wrapped) {
      map.repeat.set(u, v)
      return null
    }
    // A uniform texture repeats per two metres, another the same number of times on each face. That of an endless plane is uniform.
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
        const startRow = height === 6 * width ? i * width : 0
        return new DataTexture(rgba(texture, startRow, width), width, width, RGBAFormat)
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
    for (const thing of [...this.resources, ...this.textures.values()]) thing.dispose()
  }
}

/**
 * The finish of a material of MuJoCo for three.js: exponent and strength of the highlight, and the part that is metal.
 *
 * A microfacet surface, whose slopes have the spread `roughness`², has about the highlight of the exponent 2/roughness⁴ - 2.
 *
 * @param {Record<string, any> | undefined} info @param {number} gloss how much weaker highlights are because of their lights
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

/** The strength of highlights: in MuJoCo they have the light's specular colour, in three.js its only colour, which here is the diffuse one. */
function glossOf({ lights, visual: { headlight } }) {
  if (lights.length === 0) return WITHOUT_LIGHTS
  const sources = headlight.active ? [...lights, headlight] : lights
  const sum = (name) => sources.reduce((total, light) => total + light[name][0] + light[name][1] + light[name][2], 0)
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
  for (let i = 0, offset = firstRow * width * channels; i < count; i++, offset += channels) {
    const grey = channels < 3
    target[4 * i] = data[offset]
    target[4 * i + 1] = data[offset + (grey ? 0 : 1)]
    target[4 * i + 2] = data[offset + (grey ? 0 : 2)]
    target[4 * i + 3] = channels === 4 ? data[offset + 3] : 255
  }
  return target
}

/** Add code to the shaders of three.js, behind some of the chunks of which they are made. @param {Record<string, Record<string, string>>} additions */
export function extend(shader, additions) {
  for (const [kind, chunks] of Object.entries(additions)) {
    for (const [name, code] of Object.entries(chunks)) shader[kind] = shader[kind].replace(`#include <${name}>`, `#include <${name}>\n${code}`)
  }
}

/** Let a material look up a cube texture by the direction from the geom's centre, in the unit shape or, if `uniform`, in the geom's size. */
function wrapCube(material, texture, uniform) {
  const size = { value: [1, 1, 1] }
  material.onBeforeCompile = (shader) => {
    shader.uniforms.labCube = { value: texture }
    shader.uniforms.labSize = size
    extend(shader, {
      vertexShader: { common: 'attribute vec3 direction; varying vec3 vLabDirection; uniform vec3 labSize;', begin_vertex: 'vLabDirection = direction * labSize;' },
      fragmentShader: {
        common: 'varying vec3 vLabDirection; uniform samplerCube labCube;',
        map_fragment: 'vec4 labTexel = textureCube(labCube, vLabDirection); diffuseColor *= labTexel; totalEmissiveRadiance *= labTexel.rgb;',
      },
    })
  }
  material.userData.shader = 'lab-cube'
  material.customProgramCacheKey = () => 'lab-cube'
  return (now) => {
    if (uniform) size.value = [now[0], now[1], now[2]]
  }
}
