/**
 * C structures of the engine, read directly from its memory.
 *
 * The bindings can only copy the warning counters and the geoms of a scene, object by object, which would cost more than a step; a
 * number that is read through them after each step costs a tenth of a short one. All are plain structures whose layout belongs to the
 * engine's version. Before it is used, each reader compares its values with those of the bindings, and throws on a difference.
 *
 * The engine's memory may grow, which detaches every array on it: a view that has become empty is made anew.
 */

import { EngineError } from './engine.js'

const WRONG = 'the engine lays out its memory in another way than this version of it should'

/** The memory of the engine, found through any array of a model. */
const memory = (data) => data.xpos.buffer

const REACH = 256 // words behind a place, in which a structure's other numbers lie

/** What is looked at with each step: its length, the time, the number of contacts, and how often each warning was raised since the last reset. */
export class StepNumbers {
  /** @param {Record<string, any>} data MjData, which must outlive the numbers, as its model must @param {Record<string, any>} option of that */
  constructor(data, option) {
    this.data = data
    this.ints = new Int32Array(0)
    this.doubles = new Float64Array(0)
    // A vector of {pointer to an mjWarningStat, owned}; the structures themselves lie in mjData, one behind the other.
    const vector = data.warning
    this.count = vector.size()
    const words = this.words()
    this.start = words[words[vector.$$.ptr >> 2] >> 2] >> 2
    for (let i = 0; i < this.count; i++) this.verify(vector, i)
    this.contactsAt = this.find(data, 'ncon', this.start)
    this.timeAt = this.find(data, 'time', this.start) / 2
    this.timestepAt = this.find(option, 'timestep', words[option.$$.ptr >> 2] >> 2) / 2
  }

  verify(vector, i) {
    const words = this.words()
    const at = this.start + 2 * i + 1
    const before = words[at]
    words[at] = 1000 + i
    const copy = vector.get(i)
    words[at] = before
    if (copy.number !== 1000 + i) throw new EngineError(WRONG, true)
    copy.delete()
  }

  /** The first word from a place on whose change the bindings read in a number of an object. */
  find(object, name, start) {
    const words = this.words()
    const before = object[name]
    for (let i = start; i < start + REACH; i++) {
      const word = words[i]
      words[i] = word + 1
      const isPart = object[name] !== before
      words[i] = word
      if (isPart) return i
    }
    throw new EngineError(WRONG, true)
  }

  words() {
    if (this.ints.length === 0) {
      this.ints = new Int32Array(memory(this.data))
      this.doubles = new Float64Array(memory(this.data))
    }
    return this.ints
  }

  /** s */
  get time() {
    this.words()
    return this.doubles[this.timeAt]
  }

  /** s */
  get timestep() {
    this.words()
    return this.doubles[this.timestepAt]
  }

  get contacts() {
    return this.words()[this.contactsAt]
  }

  /** How often each warning was raised. */
  counts() {
    const words = this.words()
    return Array.from({ length: this.count }, (_, i) => words[this.start + 2 * i + 1])
  }

  /** The index that the last warning `i` refers to, in the array that it is about. */
  info(i) {
    return this.words()[this.start + 2 * i]
  }

  /** The sum of all warning counters. */
  total() {
    const { start, count } = this
    const words = this.words()
    let sum = 0
    for (let i = 0; i < count; i++) sum += words[start + 2 * i + 1]
    return sum
  }
}

/** All numbers of a model, as the engine has them: its options, visuals and statistics, which lie side by side, and its arrays. */
export class ModelWords {
  /** @param {Record<string, any>} model MjModel @param {Record<string, any>} data any MjData of the same engine */
  constructor(model, data) {
    this.data = data
    const words = new Int32Array(memory(data))
    const { center } = model.stat // the last of them, behind which stands where the arrays begin
    const [start, end] = [words[model.opt.$$.ptr >> 2], center.byteOffset + center.byteLength]
    const [first, length] = [words[end >> 2], model.nbuffer]
    const { byteOffset: inside } = model.body_mass
    if (start >= end || inside < first || inside >= first + length) throw new EngineError(WRONG, true)
    this.parts = [[start, end], [first, first + length]].map((part) => part.map((at) => at >> 2)) // words
    this.begin()
  }

  words() {
    return new Int32Array(memory(this.data))
  }

  /** Compare with the model as it is now from here on. */
  begin() {
    const words = this.words()
    this.bases = this.parts.map(([start, end]) => words.slice(start, end))
  }

  /** The words that have changed since `begin`: the place of each, then the word. */
  read() {
    const words = this.words()
    const changed = []
    this.parts.forEach(([start, end], part) => {
      const base = this.bases[part]
      for (let i = start; i < end; i++) if (words[i] !== base[i - start]) changed.push(i, words[i])
    })
    return Int32Array.from(changed)
  }

  /** Go to the model of which `read` said what has changed. @param {Int32Array} changed */
  write(changed) {
    const words = this.words()
    this.parts.forEach(([start], part) => words.set(this.bases[part], start))
    for (let i = 0; i < changed.length; i += 2) words[changed[i]] = changed[i + 1]
  }
}

const GEOM_WORDS = 63 // sizeof(mjvGeom) is 252 bytes
const GEOMS_AT = 2 // mjvScene starts with maxgeom, ngeom and a pointer to the geoms

/** The geoms of an mjvScene: rows of 32-bit words, as integers and as floats. */
export class SceneGeoms {
  /** @param {Record<string, any>} scene MjvScene; @param {Record<string, any>} data any MjData of the same engine */
  constructor(scene, data) {
    this.scene = scene
    this.data = data
    const words = new Int32Array(memory(data))
    const wrapper = scene.$$.ptr >> 2
    const candidates = [words[wrapper], words[wrapper + 1], words[wrapper + 2]]
    this.address = candidates.find((address) => address > 0 && address % 4 === 0 && words[address >> 2] === scene.maxgeom)
    if (this.address === undefined) throw new EngineError(WRONG, true)
    this.ints = new Int32Array(0)
    this.floats = new Float32Array(0)
    this.isVerified = false
  }

  /** Read again after mjv_updateScene; returns the number of geoms. */
  update() {
    if (this.ints.length === 0) {
      const buffer = memory(this.data)
      const geoms = new Int32Array(buffer, this.address, 3)[GEOMS_AT]
      this.header = new Int32Array(buffer, this.address, 2)
      this.ints = new Int32Array(buffer, geoms, GEOM_WORDS * this.scene.maxgeom)
      this.floats = new Float32Array(buffer, geoms, GEOM_WORDS * this.scene.maxgeom)
    }
    const count = this.header[1]
    if (!this.isVerified && count > 0) this.verify(count)
    return count
  }

  verify(count) {
    const vector = this.scene.geoms
    let agrees = vector.size() === count
    for (let i = 0; agrees && i < count; i++) {
      const copy = vector.get(i)
      const offset = i * GEOM_WORDS
      const { type, objid, size, pos, mat, rgba } = copy
      const fields = [[0, type], [3, objid], [12, size[2]], [13, pos[0]], [24, mat[8]], [28, rgba[3]]]
      // `Object.is`, as a diverged state gives NaN.
      agrees = fields.every(([j, x]) => Object.is(x, j < 4 ? this.ints[offset + j] : this.floats[offset + j]))
      copy.delete()
    }
    vector.delete()
    if (!agrees) throw new EngineError(WRONG, true)
    this.isVerified = true
  }

  /** The first word of geom `i`. */
  offset(i) {
    return i * GEOM_WORDS
  }
}
