/**
 * Pictures of a lab: what moves, as one Float32Array that can be handed to another thread.
 *
 * Layout, in floats; `describe().layout` names the start of each part:
 *
 *   0           8                     [0] floats in use, [1] decorations, [2] points of the trail, [3] 1 while a body is dragged
 *   geoms       19 for each geom      position 3, rotation matrix 9 (by rows), size 3, colour 4 (RGBA)
 *   sites       19 for each site      the same
 *   lights      7 for each light      position 3, direction 3, 1 if it is on
 *   cameras     13 for each camera    position 3, matrix 9 by rows (it looks along its -z, up is its y), field of view (°, vertical)
 *   flex        3 for each flex vertex
 *   skin        6 for each skin vertex: position 3, normal 3
 *   trail       3 for each point, from the oldest to the newest
 *   decorations 24 each               type (mjtGeom), data id, object type (mjtObj), object id, size 3, position 3, matrix 9,
 *                                     colour 4, emission; they begin where the trail ends
 *
 * Decorations are what MuJoCo's own visualizer adds: tendons, the overlays that are on, the spring of a drag. Behind them are the
 * arrows of `arrows.js`.
 */

import { ARROW, IN_FRONT, THICKER, arrowRows, momenta } from './arrows.js'
import { describeScene } from './scene.js'
import { SceneGeoms } from './structs.js'

const HEADER = 8
const GEOM = 19
const LIGHT = 7
const CAMERA = 13
const DECORATION = 24
const AXIS = 0.4 // of the thickness that MuJoCo gives them
const MOST_DECORATIONS = 2000
const PALE = [0.7, 0.9, 0.9, 1] // MuJoCo's colour of contact forces, hardly seen on light paper
const FORCE = [0, 0.62, 0.45, 1]
const DEFAULT_COLOUR = [0.5, 0.5, 0.5, 1] // MuJoCo's default colour: a geom that has it takes that of its material

/** The overlays that a lab can offer, and what they switch on in MuJoCo's visualizer. */
export const OVERLAYS = ['frames', 'contacts', 'forces', 'com', 'inertia', 'joints', 'momentum', 'angularMomentum', 'axis']
const OWN_OVERLAYS = OVERLAYS.slice(-3) // drawn by arrows.js, not by MuJoCo

export class Pictures {
  /**
   * @param {import('./engine.js').Engine} engine
   * @param {import('./engine.js').Handles} handles their `displayData` is drawn
   * @param {Record<string, any>} config the lab's data
   * @param {import('./sampler.js').Sampler} sampler keeps the trail
   */
  constructor(engine, handles, config, sampler) {
    const { mj } = engine
    this.engine = engine
    this.handles = handles
    this.model = handles.model
    this.data = handles.displayData
    this.config = config
    this.sampler = sampler
    this.scene = handles.adopt(new mj.MjvScene(this.model, MOST_DECORATIONS))
    this.option = handles.adopt(new mj.MjvOption())
    this.camera = handles.adopt(new mj.MjvCamera())
    this.still = handles.adopt(new mj.MjvPerturb())
    // The visualizer scales a drag and slack tendons by the distance of the camera, so there must be one.
    mj.mjv_defaultFreeCamera(this.model, this.camera)
    mj.mjv_updateCamera(this.model, this.data, this.camera, this.scene)
    this.geoms = new SceneGeoms(this.scene, this.data)
    this.layout = layOut(this.model, sampler.capacity)
    const { map } = this.model.vis
    const perNewton = config.forceScale ?? config.arrows?.forces
    // MuJoCo divides by the mean mass, and draws half of the length.
    if (perNewton) map.force = 2 * this.model.stat.meanmass * perNewton
    // Geoms, sites, skins and flexes are drawn from the model; the visualizer adds the rest.
    for (const group of ['geomgroup', 'sitegroup', 'skingroup', 'flexgroup']) this.option[group].fill(0)
    this.option.flags[engine.k.vis.PERTFORCE] = 1
    this.ownOverlays = new Set()
    this.overlays = new Set(config.overlays) // that are on
    this.pointed = null
    this.forceWidth = this.model.vis.scale.forcewidth
    for (const name of OVERLAYS) this.draw(name)
  }

  /** Switch an overlay on or off. */
  setOverlay(name, isOn) {
    this.overlays[isOn ? 'add' : 'delete'](name)
    this.draw(name)
  }

  /** Draw an overlay with thick arrows, whether it is on or not. @param {string | null} name `null`: none */
  point(name) {
    const before = this.pointed
    this.pointed = name
    this.model.vis.scale.forcewidth = this.forceWidth * (name === 'forces' ? THICKER : 1)
    for (const changed of [before, name]) if (changed !== null) this.draw(changed)
  }

  draw(name) {
    const isOn = this.overlays.has(name) || this.pointed === name
    const { vis, frame } = this.engine.k
    const flags = { contacts: vis.CONTACTPOINT, forces: vis.CONTACTFORCE, com: vis.COM, inertia: vis.INERTIA, joints: vis.JOINT }
    if (name === 'forces' && isOn) this.paintForces()
    if (name === 'frames') this.option.frame = isOn ? frame.BODY : frame.NONE
    else if (OWN_OVERLAYS.includes(name)) this.ownOverlays[isOn ? 'add' : 'delete'](name)
    else if (name in flags) this.option.flags[flags[name]] = isOn ? 1 : 0
    else throw new RangeError(`there is no overlay "${name}"`)
  }

  /** Give contact forces a colour that is seen, unless the model has its own. */
  paintForces() {
    const { contactforce } = this.model.vis.rgba
    if (PALE.every((x, i) => Math.abs(x - contactforce[i]) < 1e-6)) contactforce.set(FORCE)
  }

  /** The description of what does not move (see `scene.js`). */
  describe() {
    return describeScene(this.engine, this.handles, this.config, this.camera, this.layout)
  }

  /**
   * Write a frame of the present data.
   *
   * @param {ArrayBuffer | null | undefined} buffer used if it is large enough; else a new one is made
   * @param {import('./drag.js').Drag} drag
   * @returns {Float32Array} of exactly the floats in use
   */
  write(buffer, drag) {
    const { engine, model, data, layout } = this
    const perturb = drag.active ? drag.handle : this.still
    engine.mj.mjv_updateScene(model, data, this.option, perturb, this.camera, engine.k.category.ALL, this.scene)
    const decorations = this.geoms.update()
    const atLeast = layout.trail + 3 * this.sampler.capacity + DECORATION * decorations
    const arrows = this.arrows()
    const bytes = 4 * (atLeast + DECORATION * arrows.length)
    const target = new Float32Array(buffer && buffer.byteLength >= bytes ? buffer : new ArrayBuffer(bytes + 40 * DECORATION))
    this.writePoses(target)
    this.writeVertices(target)
    const points = this.sampler.writeTrail(target, layout.trail)
    const start = layout.trail + 3 * points
    this.writeDecorations(target, start, decorations)
    const count = decorations + arrows.length
    arrows.forEach((row, i) => target.set(row, start + DECORATION * (decorations + i)))
    const length = start + DECORATION * count
    target.set([length, count, points, drag.active ? 1 : 0, 0, 0, 0, 0])
    return target.subarray(0, length)
  }

  arrows() {
    const { engine, model, data, ownOverlays, config } = this
    return ownOverlays.size > 0 && config.arrows ? arrowRows(momenta(engine, model, data), ownOverlays, config.arrows, this.pointed) : []
  }

  writePoses(target) {
    const { model, data, layout } = this
    writeGeoms(target, layout.geoms, model, 'geom', data.geom_xpos, data.geom_xmat)
    writeGeoms(target, layout.sites, model, 'site', data.site_xpos, data.site_xmat)
    const { light_xpos, light_xdir, cam_xpos, cam_xmat } = data
    const { light_active, cam_fovy } = model
    for (let i = 0, offset = layout.lights; i < model.nlight; i++, offset += LIGHT) {
      target.set(light_xpos.subarray(3 * i, 3 * i + 3), offset)
      target.set(light_xdir.subarray(3 * i, 3 * i + 3), offset + 3)
      target[offset + 6] = light_active[i]
    }
    for (let i = 0, offset = layout.cameras; i < model.ncam; i++, offset += CAMERA) {
      target.set(cam_xpos.subarray(3 * i, 3 * i + 3), offset)
      target.set(cam_xmat.subarray(9 * i, 9 * i + 9), offset + 3)
      target[offset + 12] = cam_fovy[i]
    }
  }

  writeVertices(target) {
    const { engine, model, data, layout, scene } = this
    if (model.nflexvert > 0) target.set(data.flexvert_xpos, layout.flex)
    if (model.nskinvert === 0) return
    engine.mj.mjv_updateSkin(model, data, scene)
    const { skinvert, skinnormal } = scene
    for (let i = 0, offset = layout.skin; i < 3 * model.nskinvert; i += 3, offset += 6) {
      for (let j = 0; j < 3; j++) {
        target[offset + j] = skinvert[i + j]
        target[offset + 3 + j] = skinnormal[i + j]
      }
    }
  }

  writeDecorations(target, start, count) {
    const { ints, floats } = this.geoms
    const { CYLINDER } = this.engine.k.geom
    const { contactforce } = this.model.vis.rgba
    for (let i = 0, offset = start; i < count; i++, offset += DECORATION) {
      const source = this.geoms.offset(i)
      for (let j = 0; j < 4; j++) target[offset + j] = ints[source + j]
      target.set(floats.subarray(source + 10, source + 30), offset + 4) // size, position, matrix, colour, emission
      if (ints[source] === ARROW && contactforce.every((x, j) => target[offset + 19 + j] === x)) target[offset + 1] = IN_FRONT
      // The axes of MuJoCo's frames, long cylinders, are so thick that they would cover the body.
      if (ints[source] === CYLINDER && target[offset + 6] > target[offset + 4]) target.fill(AXIS * target[offset + 4], offset + 4, offset + 6)
    }
  }
}

/** One row for each geom or site (`kind`); the colour is resolved as MuJoCo does. */
function writeGeoms(target, start, model, kind, positions, matrices) {
  const [sizes, colours, materials] = ['size', 'rgba', 'matid'].map((name) => model[`${kind}_${name}`])
  const materialColours = model.mat_rgba
  for (let i = 0, offset = start; i < materials.length; i++, offset += GEOM) {
    target.set(positions.subarray(3 * i, 3 * i + 3), offset)
    target.set(matrices.subarray(9 * i, 9 * i + 9), offset + 3)
    target.set(sizes.subarray(3 * i, 3 * i + 3), offset + 12)
    const hasOwnColour = materials[i] < 0 || DEFAULT_COLOUR.some((x, j) => colours[4 * i + j] !== x)
    const [colour, source] = hasOwnColour ? [colours, 4 * i] : [materialColours, 4 * materials[i]]
    target.set(colour.subarray(source, source + 4), offset + 15)
  }
}

function layOut(model, trail) {
  const geoms = HEADER
  const sites = geoms + GEOM * model.ngeom
  const lights = sites + GEOM * model.nsite
  const cameras = lights + LIGHT * model.nlight
  const flex = cameras + CAMERA * model.ncam
  const skin = flex + 3 * model.nflexvert
  return Object.freeze({ geoms, sites, lights, cameras, flex, skin, trail: skin + 6 * model.nskinvert, longestTrail: trail })
}
