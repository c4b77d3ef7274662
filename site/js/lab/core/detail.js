/**
 * How finely a model is drawn: all its meshes together, and all its textures, are only so large that the picture stays fluent.
 *
 * What is smaller than a common size is drawn whole, and what is larger with that size; so the largest lose most, and nothing is left out.
 * Nothing that is computed depends on it.
 */

const MOST_FACES = 200_000 // triangles of all geoms that are drawn
const MOST_TEXELS = 64 << 20 // bytes
const SHOWN_GROUPS = 3
const SHRINKAGE = 0.9 // of the cells that are tried next
const FLAT = 0 // mjtTexture

/**
 * A scene (core/scene.js) with no more detail than that; its `coarse` has the names of the meshes and textures that had more.
 *
 * @param {Record<string, any>} scene @param {Record<string, number>} kinds mjtGeom
 * @returns {Record<string, any>}
 */
export function limitDetail(scene, { MESH, SDF }, mostFaces = MOST_FACES, mostTexels = MOST_TEXELS) {
  const uses = scene.meshes.map(() => 0)
  for (const { type, group, data } of scene.geoms) if ((type === MESH || type === SDF) && group < SHOWN_GROUPS) uses[data] += 1
  const coarse = []
  const limit = (parts, sizes, most, reduce) => {
    const share = fairShare(sizes, most)
    return parts.map((part, i) => {
      if (sizes[i][1] === 0 || sizes[i][0] <= share) return part
      coarse.push(part.name)
      return reduce(part, share)
    })
  }
  const meshes = limit(scene.meshes, scene.meshes.map(({ faces }, i) => [faces.length / 3, uses[i]]), mostFaces, coarsen) // prettier-ignore
  const textures = limit(scene.textures, scene.textures.map(({ data }) => [data.length, 1]), mostTexels, (texture, share) => {
    const scale = Math.sqrt(share / texture.data.length)
    return resize(texture, (side) => Math.max(1, Math.floor(scale * side)))
  }) // prettier-ignore
  return { ...scene, meshes, textures, coarse }
}

/** The size to which parts are cut so that all of them together have `most`. @param {[number, number][]} parts size and count */
function fairShare(parts, most) {
  let count = parts.reduce((sum, [, uses]) => sum + uses, 0)
  for (const [size, uses] of [...parts].sort(([a], [b]) => a - b)) {
    if (size * count > most) return most / count
    most -= size * uses
    count -= uses
  }
  return Infinity
}

/** A mesh with at most so many triangles: of the vertices in each cell of a grid only their mean is left. */
function coarsen(mesh, most) {
  const low = /** @type {[number, number, number]} */ ([Infinity, Infinity, Infinity])
  const high = [-Infinity, -Infinity, -Infinity]
  mesh.vertices.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3], x)
    high[i % 3] = Math.max(high[i % 3], x)
  })
  const length = Math.max(...high.map((x, j) => x - low[j]))
  for (let cells = 2 * Math.sqrt(most); ; ) {
    const coarse = merge(mesh, low, length / cells, Math.ceil(cells) + 1)
    const count = coarse.faces.length / 3
    if (count <= most) return coarse
    cells *= SHRINKAGE * Math.sqrt(most / count)
  }
}

/** Merge the vertices in each cell of a grid, whose cells have a size; `row` of them are more than a mesh is long. */
function merge(mesh, [lowX, lowY, lowZ], size, row) {
  const { vertices, normals, faces, faceNormals, faceTexcoords } = mesh
  const numbers = new Map() // of the vertices that are left, by their cells
  const numberOf = new Uint32Array(vertices.length / 3)
  for (let i = 0, at = 0; i < numberOf.length; i++, at += 3) {
    const x = Math.floor((vertices[at] - lowX) / size)
    const y = Math.floor((vertices[at + 1] - lowY) / size)
    const cell = (x * row + y) * row + Math.floor((vertices[at + 2] - lowZ) / size)
    if (!numbers.has(cell)) numbers.set(cell, numbers.size)
    numberOf[i] = numbers.get(cell)
  }
  const places = new Float32Array(3 * numbers.size)
  const directions = new Float32Array(3 * numbers.size)
  const members = new Uint32Array(numbers.size)
  numberOf.forEach((number, i) => {
    members[number] += 1
    for (let j = 0; j < 3; j++) places[3 * number + j] += (vertices[3 * i + j] - places[3 * number + j]) / members[number]
  })
  const left = [] // the corners of the faces that are left
  for (let i = 0; i < faces.length; i += 3) {
    const [a, b, c] = [numberOf[faces[i]], numberOf[faces[i + 1]], numberOf[faces[i + 2]]]
    if (a === b || b === c || c === a) continue
    for (let corner = i; corner < i + 3; corner++) {
      left.push(corner)
      for (let j = 0; j < 3; j++) directions[3 * numberOf[faces[corner]] + j] += normals[3 * faceNormals[corner] + j]
    }
  }
  for (let i = 0; i < directions.length; i += 3) {
    const length = Math.hypot(directions[i], directions[i + 1], directions[i + 2]) || 1
    for (let j = i; j < i + 3; j++) directions[j] /= length
  }
  const merged = Int32Array.from(left, (corner) => numberOf[faces[corner]])
  const texcoords = faceTexcoords && Int32Array.from(left, (corner) => faceTexcoords[corner])
  return { ...mesh, vertices: places, normals: directions, faces: merged, faceNormals: merged, faceTexcoords: texcoords }
}

/** A texture with other sides; each of the six faces of a cube is one for itself. @param {(side: number) => number} scale */
export function resize(texture, scale) {
  const { type, width, height, channels, data } = texture
  const faces = type !== FLAT && height === 6 * width ? 6 : 1
  const [w, h] = [scale(width), faces * scale(height / faces)]
  if (w === width && h === height) return texture
  return { ...texture, width: w, height: h, data: downsample(data, [width, height], [w, h], channels) }
}

/** Reduce an image: each new texel is the mean of those that it replaces. */
function downsample(data, [width, height], [w, h], channels) {
  const target = new Uint8Array(w * h * channels)
  for (let j = 0, texel = 0; j < h; j++) {
    const [top, bottom] = [j, j + 1].map((k) => Math.floor((k * height) / h))
    for (let i = 0; i < w; i++) {
      const [left, right] = [i, i + 1].map((k) => Math.floor((k * width) / w))
      for (let c = 0; c < channels; c++, texel++) {
        let sum = 0
        for (let y = top; y < bottom; y++) for (let x = left; x < right; x++) sum += data[(y * width + x) * channels + c]
        target[texel] = Math.round(sum / ((bottom - top) * (right - left)))
      }
    }
  }
  return target
}
