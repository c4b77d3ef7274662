/**
 * What all labs of a page share, and whether a lab has changed it: JavaScript's own objects, the globals, and the engine's functions.
 *
 *   const guard = new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
 *   guard.changes()  → ['Math.sin', …]     empty: nothing has changed
 *   guard.repair()                         puts everything back
 *
 * The labs of a page run in one worker, and those of a build in one V8: a lab that changes `Array.prototype` changes it for the
 * next. Everything that can be reached from the roots by properties and prototypes is looked at. Nothing that lab code can replace is
 * called: not a method, not an iterator.
 */

const { apply, defineProperty, deleteProperty, getOwnPropertyDescriptor, getPrototypeOf, ownKeys, setPrototypeOf } = Reflect
const { is } = Object
const { get, set, has } = Map.prototype
const { toString } = Symbol.prototype
const MOST = 20 // changes that are named

export class Guard {
  /** @param {[string, object, boolean][]} roots name and object; whether of its properties only the functions count */
  constructor(roots) {
    this.known = new Map()
    this.records = []
    for (let i = 0; i < roots.length; i++) this.add(roots[i][1], roots[i][0] === 'globalThis' ? '' : roots[i][0], roots[i][2])
    for (let i = 0; i < HIDDEN.length; i++) this.add(HIDDEN[i][1], HIDDEN[i][0])
    // What is reached first has the shortest name.
    for (let i = 0; i < this.records.length; i++) this.follow(this.records[i])
  }

  add(object, name, onlyFunctions = false) {
    if (object === null || (typeof object !== 'object' && typeof object !== 'function')) return
    if (apply(has, this.known, [object])) return
    const record = { object, name, onlyFunctions, prototype: getPrototypeOf(object), keys: [], properties: new Map() }
    apply(set, this.known, [object, record])
    this.records[this.records.length] = record
  }

  follow(record) {
    const { object, name, onlyFunctions, keys, properties } = record
    const found = ownKeys(object)
    for (let i = 0; i < found.length; i++) {
      const descriptor = getOwnPropertyDescriptor(object, found[i])
      if (onlyFunctions && typeof descriptor.value !== 'function') continue
      keys[keys.length] = found[i]
      apply(set, properties, [found[i], descriptor])
      const inner = nameOf(name, found[i])
      this.add(descriptor.value, inner)
      this.add(descriptor.get, inner)
      this.add(descriptor.set, inner)
    }
    this.add(record.prototype, `${name}.__proto__`)
  }

  /** The names of what was changed, added or taken away since the guard was made; 20 at most. */
  changes() {
    const names = []
    this.each((record, key) => {
      const name = key === null ? `${record.name || 'globalThis'}.__proto__` : nameOf(record.name, key)
      if (names.length < MOST) names[names.length] = name
    })
    return names
  }

  /** Put back what can be put back. */
  repair() {
    this.each(({ object, prototype, properties }, key) => {
      if (key === null) return void setPrototypeOf(object, prototype)
      const before = apply(get, properties, [key])
      if (before === undefined) deleteProperty(object, key)
      else defineProperty(object, key, before)
    })
  }

  /** Call `found` with the record and the key (`null`: its prototype) of each change. */
  each(found) {
    for (let i = 0; i < this.records.length; i++) {
      const record = this.records[i]
      const { object, onlyFunctions, prototype, keys, properties } = record
      if (getPrototypeOf(object) !== prototype) found(record, null)
      for (let j = 0; j < keys.length; j++) {
        if (!same(apply(get, properties, [keys[j]]), getOwnPropertyDescriptor(object, keys[j]))) found(record, keys[j])
      }
      if (onlyFunctions) continue
      const now = ownKeys(object)
      for (let j = 0; j < now.length; j++) if (!apply(has, properties, [now[j]])) found(record, now[j])
    }
  }
}

/** Objects of the language to which no name leads. */
const HIDDEN = [
  ['the iterators of arrays', getPrototypeOf([][Symbol.iterator]())],
  ['the iterators of maps', getPrototypeOf(new Map()[Symbol.iterator]())],
  ['the iterators of sets', getPrototypeOf(new Set()[Symbol.iterator]())],
  ['the iterators of texts', getPrototypeOf(''[Symbol.iterator]())],
  ['generators', getPrototypeOf(function* () {})],
  ['asynchronous functions', getPrototypeOf(async () => {})],
  ['asynchronous generators', getPrototypeOf(async function* () {})],
]

function same(before, now) {
  if (now === undefined) return false
  // A getter of the language may make its value a plain one when it is first read; it is the value that counts.
  return is(before.value, now.value) && before.get === now.get && before.set === now.set && before.writable === now.writable
}

function nameOf(name, key) {
  const text = typeof key === 'symbol' ? `[${apply(toString, key, [])}]` : key
  return name === '' || typeof key === 'symbol' ? `${name}${text}` : `${name}.${text}`
}
