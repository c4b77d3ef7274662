/**
 * The constant part of a model's appearance: plain values and copies of arrays, ready to be sent to another thread.
 *
 * The page builds its meshes, textures and lights from it once; their places, colours and sizes come with every frame
 * (see `frame.js`). Ids are MuJoCo's; -1 means none. Angles are in degrees, lengths in metres.
 */

import { nameOf } from './names.js'

const TEXTURE_ROLES = 10 // mjNTEXROLE
const ROLE_USER = 0
const ROLE_RGB = 1
const COLOURLESS = 0.1 // largest difference of red, green and blue
const STEEPEST = 1e-3 // half the angle of a level plane

/**
 * @param {import('./engine.js').Engine} engine
 * @param {import('./engine.js').Handles} handles
 * @param {Record<string, any>} config the lab's data
 * @param {Record<string, any>} camera an MjvCamera to work with
 * @param {Record<string, any>} layout of the frames
 */
export function describeScene(engine, { model, displayData: data }, config, camera, layout) {
  const { mj, k } = engine
  const name = (type, i) => nameOf(engine, model, type, i)
  const list = (count, make) => Array.from({ length: count }, (_, i) => make(i))
  const { stat, vis } = model
  const { extent = stat.extent } = config // of the model for which camera and floor were computed
  const fits = !config.isOther && stat.extent < 1.5 * extent && extent < 1.5 * stat.extent
  return {
    layout: { ...layout },
    timestep: model.opt.timestep,
    camera: freeCamera(mj, model, fits ? config.camera : null, camera),
    floor: fits ? (config.floor ?? null) : null,
    center: Array.from(stat.center),
    extent: stat.extent,
    visual: { headlight: headlight(vis.headlight), znear: vis.map.znear, zfar: vis.map.zfar },
    bodies: list(model.nbody, (i) => ({ movable: model.body_weldid[i] !== 0 || model.body_mocapid[i] >= 0 })),
    geoms: list(model.ngeom, (i) => ({
      name: name(k.obj.GEOM, i),
      type: model.geom_type[i],
      body: model.geom_bodyid[i],
      group: model.geom_group[i],
      material: model.geom_matid[i],
      data: model.geom_dataid[i],
      level: levelOf(k, model, i),
    })),
    sites: list(model.nsite, (i) => ({ type: model.site_type[i], group: model.site_group[i], material: model.site_matid[i] })),
    springs: list(model.njnt, (i) => spring(k, model, i)).filter((shape) => shape !== null),
    pins: list(model.njnt, (i) => pin(k, model, data, i)).filter((shape) => shape !== null),
    materials: list(model.nmat, (i) => material(model, i, name(k.obj.MATERIAL, i))),
    textures: list(model.ntex, (i) => texture(model, i, name(k.obj.TEXTURE, i))),
    meshes: list(model.nmesh, (i) => mesh(model, i, name(k.obj.MESH, i))),
    hfields: list(model.nhfield, (i) => hfield(model, i)),
    lights: list(model.nlight, (i) => light(model, i)),
    flexes: list(model.nflex, (i) => flex(model, i, name(k.obj.FLEX, i))),
    skins: list(model.nskin, (i) => skin(model, i)),
  }
}

/** The height of a level plane of the world that is grey and no more, which a view with a floor of its own need not draw; else null. */
function levelOf(k, model, i) {
  const [r, g, b, a] = row(model.geom_rgba, i, 4)
  const [, x, y] = row(model.geom_quat, i, 4)
  const isGrey = model.geom_matid[i] < 0 && a === 1 && Math.max(r, g, b) - Math.min(r, g, b) <= COLOURLESS
  const isLevel = model.geom_type[i] === k.geom.PLANE && model.geom_bodyid[i] === 0 && Math.hypot(x, y) < STEEPEST
  return isGrey && isLevel ? model.geom_pos[3 * i + 2] : null
}

const part = (array, start, count) => array.slice(start, start + count)
const row = (array, i, n) => Array.from(array.subarray(n * i, n * i + n))

/** The spring to draw for a slide joint with stiffness: from the first geom of the parent that is no plane or height field to that of its body. */
function spring(k, model, i) {
  const body = model.jnt_bodyid[i]
  if (model.jnt_type[i] !== k.joint.SLIDE || !(model.jnt_stiffness[i] > 0) || model.body_geomnum[body] === 0) return null
  const geom = model.body_geomadr[body]
  const parent = model.body_parentid[body]
  const firstGeom = model.body_geomadr[parent]
  const holders = Array.from({ length: model.body_geomnum[parent] }, (_, j) => firstGeom + j)
  const holder = holders.find((g) => model.geom_type[g] > k.geom.HFIELD)
  return holder === undefined ? null : { from: holder, to: geom, radius: 0.4 * Math.min(model.geom_rbound[holder], model.geom_rbound[geom]) }
}

/** A hinge that is fixed to the world. */
function pin(k, model, data, i) {
  if (model.jnt_type[i] !== k.joint.HINGE || model.body_weldid[model.body_parentid[model.jnt_bodyid[i]]] !== 0) return null
  return { position: row(data.xanchor, i, 3), axis: row(data.xaxis, i, 3) }
}

/** MuJoCo's free camera for the model, with the lab's settings in place of its defaults. */
function freeCamera(mj, model, settings, camera) {
  mj.mjv_defaultFreeCamera(model, camera)
  return {
    azimuth: settings?.azimuth ?? camera.azimuth,
    elevation: settings?.elevation ?? camera.elevation,
    distance: settings?.distance ?? camera.distance,
    target: settings?.target ?? Array.from(camera.lookat),
    orthographic: camera.orthographic !== 0,
    fovy: model.vis.global.fovy,
  }
}

function headlight({ ambient, diffuse, specular, active }) {
  return { ambient: Array.from(ambient), diffuse: Array.from(diffuse), specular: Array.from(specular), active: active !== 0 }
}

function material(model, i, name) {
  const roles = model.mat_texid.subarray(TEXTURE_ROLES * i, TEXTURE_ROLES * (i + 1))
  return {
    name,
    rgba: row(model.mat_rgba, i, 4),
    texture: roles[ROLE_RGB] >= 0 ? roles[ROLE_RGB] : roles[ROLE_USER],
    texuniform: model.mat_texuniform[i] !== 0,
    texrepeat: row(model.mat_texrepeat, i, 2),
    emission: model.mat_emission[i],
    specular: model.mat_specular[i],
    shininess: model.mat_shininess[i],
    reflectance: model.mat_reflectance[i],
    metallic: model.mat_metallic[i],
    roughness: model.mat_roughness[i],
  }
}

/** `type`: 0 2d, 1 cube (six faces, one above the other, unless square), 2 skybox; rows from the bottom, as OpenGL has them. */
function texture(model, i, name) {
  const width = model.tex_width[i]
  const height = model.tex_height[i]
  const channels = model.tex_nchannel[i]
  const data = part(model.tex_data, Number(model.tex_adr[i]), width * height * channels)
  return { name, type: model.tex_type[i], width, height, channels, data }
}

/** Each corner of a face has its own index of vertex, normal and texture coordinate. */
function mesh(model, i, name) {
  const faces = model.mesh_facenum[i]
  const face = 3 * model.mesh_faceadr[i]
  const textured = model.mesh_texcoordadr[i] >= 0
  return {
    name,
    vertices: part(model.mesh_vert, 3 * model.mesh_vertadr[i], 3 * model.mesh_vertnum[i]),
    normals: part(model.mesh_normal, 3 * model.mesh_normaladr[i], 3 * model.mesh_normalnum[i]),
    texcoords: textured ? part(model.mesh_texcoord, 2 * model.mesh_texcoordadr[i], 2 * model.mesh_texcoordnum[i]) : null,
    faces: part(model.mesh_face, face, 3 * faces),
    faceNormals: part(model.mesh_facenormal, face, 3 * faces),
    faceTexcoords: textured ? part(model.mesh_facetexcoord, face, 3 * faces) : null,
  }
}

/** `size`: half-lengths in x and y, height of 1, thickness below 0; `data` by rows, from -y to y, in [0, 1]. */
function hfield(model, i) {
  const rows = model.hfield_nrow[i]
  const columns = model.hfield_ncol[i]
  const data = part(model.hfield_data, model.hfield_adr[i], rows * columns)
  return { rows, columns, size: row(model.hfield_size, i, 4), data }
}

function light(model, i) {
  return {
    type: model.light_type[i],
    castshadow: model.light_castshadow[i] !== 0,
    ambient: row(model.light_ambient, i, 3),
    diffuse: row(model.light_diffuse, i, 3),
    specular: row(model.light_specular, i, 3),
    cutoff: model.light_cutoff[i],
    exponent: model.light_exponent[i],
  }
}

/** `elements`: vertices of each line (dim 1) or triangle (dim 2), or of the surface of a volume (dim 3), counted in the flex. */
function flex(model, i, name) {
  const dim = model.flex_dim[i]
  const elements =
    dim === 3
      ? part(model.flex_shell, model.flex_shelldataadr[i], 3 * model.flex_shellnum[i])
      : part(model.flex_elem, model.flex_elemdataadr[i], (dim + 1) * model.flex_elemnum[i])
  return {
    name,
    dim,
    elements,
    start: model.flex_vertadr[i],
    count: model.flex_vertnum[i],
    radius: model.flex_radius[i],
    flat: model.flex_flatskin[i] !== 0,
    group: model.flex_group[i],
    material: model.flex_matid[i],
    rgba: row(model.flex_rgba, i, 4),
  }
}

function skin(model, i) {
  const count = model.skin_vertnum[i]
  const start = model.skin_texcoordadr[i]
  return {
    faces: part(model.skin_face, 3 * model.skin_faceadr[i], 3 * model.skin_facenum[i]),
    texcoords: start >= 0 ? part(model.skin_texcoord, 2 * start, 2 * count) : null,
    start: model.skin_vertadr[i],
    count,
    group: model.skin_group[i],
    material: model.skin_matid[i],
    rgba: row(model.skin_rgba, i, 4),
  }
}
