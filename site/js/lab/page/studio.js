/**
 * The surroundings of a model in its picture, which are no part of it: a floor with a grid, the shadow on it, and lines around bodies.
 *
 * The grid fades with the distance, so that nobody takes it for an object. The shadow is the model projected onto the floor, once for
 * each of several points of an extended light, so that its edge is soft.
 */

import { BackSide, DoubleSide, Group, Mesh, MeshBasicMaterial, NotEqualStencilFunc, PlaneGeometry, ReplaceStencilOp, ShaderMaterial, Vector2 } from 'three'
import { ABOVE } from './lights.js'

export const STUDIO_LAYER = 1 // the layer of these objects: no mirror shows it
const CELLS = 10 // of the grid, about, in the height of the picture
const GREY = 0.5 // of lines, on light and on dark paper
const SHADOW = 0.32 // part of the light that is left in the middle of a shadow
const POINTS = 10 // of the light, at most
const MOST = 360 // meshes that are projected onto the floor
const MOST_TRIANGLES = 100_000 // of the projected meshes, and of those that are outlined
const WIDTH = 0.08 // radius of the light, for a distance of 1
const GOLDEN = Math.PI * (3 - Math.sqrt(5)) // multiples of this angle spread points evenly over a disc
const EDGE = 1.1 // CSS pixels

export class Floor {
  /**
   * @param {import('three').Scene} scene
   * @param {number} height m @param {number} distance of the camera, m
   * @param {import('three').Mesh[]} bodies whose shadows fall on it
   */
  constructor(scene, height, distance, bodies) {
    this.height = height
    this.cell = roundLength((0.8 * distance) / CELLS)
    this.grid = new Mesh(new PlaneGeometry(2, 2), gridMaterial(this.cell, 2.2 * distance))
    this.grid.matrixAutoUpdate = false
    this.grid.renderOrder = -2
    this.far = 2.2 * distance
    this.lift = 0.0005 * distance // above a plane of the model at the same height
    this.grid.layers.set(STUDIO_LAYER)
    scene.add(this.grid)
    this.bodies = bodies
    const points = Math.max(1, Math.min(POINTS, Math.floor(MOST / Math.max(1, bodies.length)), Math.floor(MOST_TRIANGLES / countTriangles(bodies))))
    this.layers = Array.from({ length: points }, (_, i) => this.layer(i, points))
    for (const { group } of this.layers) scene.add(group)
  }

  /** The shadow cast by one point of the light. */
  layer(i, count) {
    const [angle, radius] = [GOLDEN * i, WIDTH * Math.sqrt((i + 0.5) / count)]
    const [x, y] = [ABOVE[0] + radius * Math.cos(angle), ABOVE[1] + radius * Math.sin(angle)].map((a) => a / ABOVE[2])
    const group = new Group()
    group.matrixAutoUpdate = false
    const h = this.height + this.lift
    group.matrix.set(1, 0, -x, x * h, 0, 1, -y, y * h, 0, 0, 0, h, 0, 0, 0, 1)
    const material = new MeshBasicMaterial({
      color: 0, opacity: 1 - (1 - SHADOW) ** (1 / count), transparent: true, depthWrite: false,
      side: DoubleSide, forceSinglePass: true, // in any order: the stencil lets each pixel be darkened once
      stencilWrite: true, stencilRef: i + 1, stencilFunc: NotEqualStencilFunc, stencilZPass: ReplaceStencilOp,
    }) // prettier-ignore
    const meshes = this.bodies.map((body) => {
      const mesh = new Mesh(body.geometry, material)
      mesh.matrixAutoUpdate = mesh.frustumCulled = false
      mesh.matrix = body.matrix
      mesh.renderOrder = -1
      mesh.layers.set(STUDIO_LAYER)
      group.add(mesh)
      return mesh
    })
    return { group, meshes, material }
  }

  /** Follow the bodies, and the camera's target. */
  update([x, y]) {
    const { far, grid } = this
    grid.matrix.set(far, 0, 0, x, 0, far, 0, y, 0, 0, far, this.height + this.lift / 2, 0, 0, 0, 1)
    grid.matrixWorldNeedsUpdate = true
    for (const { group, meshes } of this.layers) {
      group.matrixWorldNeedsUpdate = true
      meshes.forEach((mesh, i) => (mesh.visible = this.bodies[i].visible))
    }
  }

  dispose() {
    this.grid.geometry.dispose()
    this.grid.material.dispose()
    for (const { material } of this.layers) material.dispose()
  }
}

/** The largest length of 1, 2 or 5 times a power of ten that is not longer. */
export function roundLength(length) {
  const power = 10 ** Math.floor(Math.log10(length))
  return power * [5, 2, 1].find((n) => n * power <= length)
}

function gridMaterial(cell, far) {
  return new ShaderMaterial({
    uniforms: { cell: { value: cell }, far: { value: far } },
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
    vertexShader: `
      varying vec2 place, offset;
      uniform float far;
      void main() {
        vec4 world = modelMatrix * vec4(position, 1.0);
        place = world.xy;
        offset = position.xy;
        gl_Position = projectionMatrix * viewMatrix * world;
      }`,
    fragmentShader: `
      varying vec2 place, offset;
      uniform float cell;
      float lines(float size) {
        vec2 at = place / size;
        vec2 wide = max(fwidth(at), 1e-6);
        vec2 near = abs(fract(at - 0.5) - 0.5) / wide;
        vec2 line = clamp(1.0 - near, 0.0, 1.0) * clamp(0.5 / wide - 0.5, 0.0, 1.0);
        return max(line.x, line.y);
      }
      void main() {
        float fade = pow(max(0.0, 1.0 - length(offset)), 2.0);
        float line = max(0.55 * lines(cell), lines(5.0 * cell));
        gl_FragColor = vec4(vec3(${GREY}), fade * (0.06 + 0.5 * line));
      }`,
  })
}

/** @param {import('three').Mesh[]} meshes @returns {number} at least 1 */
function countTriangles(meshes) {
  return meshes.reduce((sum, { geometry }) => sum + (geometry.index ?? geometry.attributes.position).count / 3, 1)
}

/** Whether meshes are few enough to be drawn once more for their outlines. @param {import('three').Mesh[]} meshes */
export const canOutline = (meshes) => countTriangles(meshes) <= MOST_TRIANGLES

/** Outlines of meshes, against a ground of like colour: the back of each mesh, a little larger, is drawn behind it. */
export class Edges {
  constructor() {
    this.edges = []
    this.screen = { value: new Vector2(1, 1) }
    this.material = new ShaderMaterial({
      uniforms: { screen: this.screen },
      side: BackSide,
      vertexShader: `
        uniform vec2 screen;
        void main() {
          vec4 at = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
          vec2 out2 = (projectionMatrix * vec4(normalMatrix * normal, 0.0)).xy;
          at.xy += ${(2 * EDGE).toFixed(1)} * at.w * normalize(out2 * screen + 1e-9) / screen;
          gl_Position = at;
        }`,
      fragmentShader: `void main() { gl_FragColor = vec4(vec3(0.42), 1.0); }`,
    })
  }

  /** Outline a mesh, as long as its material is opaque. */
  add(mesh, material) {
    const edge = new Mesh(mesh.geometry, this.material)
    edge.matrixAutoUpdate = false
    edge.frustumCulled = mesh.frustumCulled
    edge.layers.set(STUDIO_LAYER)
    mesh.add(edge)
    this.edges.push({ edge, material })
  }

  /** Prepare for a picture of `width` by `height` CSS pixels. */
  update(width, height) {
    this.screen.value.set(width, height)
    for (const { edge, material } of this.edges) edge.visible = !material.transparent
  }

  dispose() {
    this.material.dispose()
  }
}
