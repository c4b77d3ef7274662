/**
 * Detects whether a lab, or an attempt at an exercise, has changed what others share: JavaScript's own objects, the globals, and the
 * engine's functions.
 *
 *   const guard = new Guard([['globalThis', globalThis, false], ['mj', engine.mj, true]])
 *   guard.changes()  → ['Math.sin', …]     empty: nothing has changed
 *   guard.repair()                         puts everything back
 *
 * The labs of a page run in one worker, and those of a build in one V8: a lab that changes `Array.prototype` changes it for the
 * next. Everything that can be reached from the roots by properties and prototypes is compared. Nothing that lab code can replace is
 * called here: no method, no iterator.
 */

const { apply, defineProperty, deleteProperty, getOwnPropertyDescriptor, getPrototypeOf, ownKeys, setPrototypeOf } = Reflect
const { is } = Object
const { get, set, has } = Map.prototype
const { toString } = Symbol.prototype
const MOST = 20 // changes that are listed

export class Guard {
  /** @param {[string, Record<string, any>, boolean][]} roots name and object, and whether only those of its properties count that are functions */
  constructor(roots) {
    this.recordsByObject = new Map()
    this.records = []
    for (let i = 0; i < roots.length; i++) this.add(roots[i][1], roots[i][0] === 'globalThis' ? '' : roots[i][0], roots[i][2])
    for (let i = 0; i < HIDDEN.length; i++) this.add(HIDDEN[i][1], HIDDEN[i][0])
    // Breadth first, so that each object gets its shortest name.
    for (let i = 0; i < this.records.length; i++) this.follow(this.records[i])
  }

  add(object, name, onlyFunctions = false) {
    if (object === null || (typeof object !== 'object' && typeof object !== 'function')) return
    if (apply(has, this.recordsByObject, [object])) return
    const record = { object, name, onlyFunctions, prototype: getPrototypeOf(object), keys: [], properties: new Map() }
    apply(set, this.recordsByObject, [object, record])
    this.records[this.records.length] = record
  }

  follow(record) {
    const { object, name, onlyFunctions, keys, properties } = record
    const propertyKeys = ownKeys(object)
    for (let i = 0; i < propertyKeys.length; i++) {
      const descriptor = getOwnPropertyDescriptor(object, propertyKeys[i])
      if (onlyFunctions && typeof descriptor.value !== 'function') continue
      keys[keys.length] = propertyKeys[i]
      apply(set, properties, [propertyKeys[i], descriptor])
      const inner = nameOf(name, propertyKeys[i])
      this.add(descriptor.value, inner)
      this.add(descriptor.get, inner)
      this.add(descriptor.set, inner)
    }
    this.add(record.prototype, `${name}.__proto__`)
  }

  /** The names of what was changed, added or removed since the guard was made; at most 20. */
  changes() {
    const names = []
    this.visitChanges((record, key) => {
      const name = key === null ? `${record.name || 'globalThis'}.__proto__` : nameOf(record.name, key)
      if (names.length < MOST) names[names.length] = name
    })
    return names
  }

  /** Restore what can be restored. */
  repair() {
    this.visitChanges(({ object, prototype, properties }, key) => {
      if (key === null) return void setPrototypeOf(object, prototype)
      const descriptor = apply(get, properties, [key])
      if (descriptor === undefined) deleteProperty(object, key)
      else defineProperty(object, key, descriptor)
    })
  }

  /** Call `visit` with the record and the key (`null`: its prototype) of each change. */
  visitChanges(visit) {
    for (let i = 0; i < this.records.length; i++) {
      const record = this.records[i]
      const { object, onlyFunctions, prototype, keys, properties } = record
      if (getPrototypeOf(object) !== prototype) visit(record, null)
      for (let j = 0; j < keys.length; j++) {
        if (!isSame(apply(get, properties, [keys[j]]), getOwnPropertyDescriptor(object, keys[j]))) visit(record, keys[j])
      }
      if (onlyFunctions) continue
      const currentKeys = ownKeys(object)
      for (let j = 0; j < currentKeys.length; j++) if (!apply(has, properties, [currentKeys[j]])) visit(record, currentKeys[j])
    }
  }
}

/** Objects of the language that cannot be reached by any name. */
const HIDDEN = [
  ['the iterators of arrays', getPrototypeOf([][Symbol.iterator]())],
  ['the iterators of maps', getPrototypeOf(new Map()[Symbol.iterator]())],
  ['the iterators of sets', getPrototypeOf(new Set()[Symbol.iterator]())],
  ['the iterators of texts', getPrototypeOf(''[Symbol.iterator]())],
  ['generators', getPrototypeOf(function* () {})],
  ['asynchronous functions', getPrototypeOf(async () => {})],
  ['asynchronous generators', getPrototypeOf(async function* () {})],
]

function isSame(before, now) {
  if (now === undefined) return false
  // A getter of the language may turn into a plain value on first read, so values are compared too.
  return is(before.value, now.value) && before.get === now.get && before.set === now.set && before.writable === now.writable
}

function nameOf(name, key) {
  const text = typeof key === 'symbol' ? `[${apply(toString, key, [])}]` : key
  return name === '' || typeof key === 'symbol' ? `${name}${text}` : `${name}.${text}`
}
