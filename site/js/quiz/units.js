/**
 * Reads units, and converts between those that measure the same.
 *
 *   readUnit('kg·m²')[0]                     → { scale: 1, offset: 0, powers: { kg: 1, m: 2 } }
 *   relation(readUnit('g cm^2'), readUnit('kg m^2'))  → { factor: 1e-7, offset: 0 }
 *
 * The units and their names are those of the course's checks: of each symbol the scale, the powers of the base units, whether it takes
 * prefixes, and where its scale begins (K). An angle is no dimension, but treating it as one reveals mistakes: `rad`
 * and `deg` may be omitted or added, but hertz count cycles and are not taken for radians per second.
 */

import { normalise } from './numbers.js'
import table from './unit-table.json' with { type: 'json' }

/** @type {Record<string, any>} */
const UNITS = table.units
const PREFIXES = {
  Q: 30, R: 27, Y: 24, Z: 21, E: 18, P: 15, T: 12, G: 9, M: 6, k: 3, h: 2, da: 1,
  d: -1, c: -2, m: -3, μ: -6, u: -6, n: -9, p: -12, f: -15, a: -18, z: -21, y: -24, r: -27, q: -30,
}
const ONE = { scale: 1, offset: 0, powers: {} }
const ANGLE = 'rad'
const CYCLES = 'cycle'

/** Other ways to write a unit: the names of the table, and slips. */
const NAMES = {
  ...table.names,
  "'": '′', grad: '°', Deg: '°', degré: '°', degrés: '°', revs: 'rev', Kg: 'kg', KG: 'kg', kilogram: 'kg', kilograms: 'kg',
  hz: 'Hz', HZ: 'Hz', Rad: 'rad', Nm: 'N m',
}

/**
 * @typedef {{scale: number, offset: number, powers: Object<string, number>}} Unit in base units; `offset` (K) is added first (°C)
 */

/**
 * The readings of a text as a unit, the strict one first: mostly one; more if several factors follow a solidus (`J/kg K`), or if a
 * prefix may also be a unit (`ms⁻¹`, a millisecond or a metre per second).
 *
 * @returns {Unit[]} empty if it is no unit; an empty text is the unit 1
 */
export function readUnit(text) {
  const source = plain(text)
  if (source === '') return [ONE]
  const readings = [{}, { split: true }].map((way) => parse(source, way))
  if (/\/.*[ *]/.test(source)) readings.push(parse(source, { wide: true }))
  return readings.filter((unit) => unit !== null)
}

/** The normalised text of a unit, to compare units that are unknown. */
export function plain(text) {
  const bare = text
    .slice(0, 100)
    .replace(/\\(?:mathrm|text|rm|operatorname)\b/g, ' ')
    .replace(/\\(?:[,;:! ]|cdot|times|quad)/g, ' ')
    .replace(/\\mu\b(?:\{\})? ?/g, 'μ')
    .replace(/\\Omega\b/g, 'Ω')
    .replace(/\^? ?\{?\\(?:degree|circ)\}?/g, '°')
    .replace(/[$~]/g, ' ')
  return normalise(bare)
    .replace(/\^ ?\{([^{}]*)\}/g, '^($1)')
    .replace(/[{}]/g, ' ')
    .replace(/ per /g, '/')
    .replace(/″/g, '"')
    .replace(/° ?C(?![\p{L}])/gu, '°C')
    .replace(/(\p{L})\.(?=\p{L})/gu, '$1*')
    .replace(/ *([*/^()]) */g, (_, sign) => (sign === '(' ? ' (' : sign === ')' ? ') ' : sign))
    .replace(/ *([*/^]) */g, '$1')
    .replace(/ +/g, ' ')
    .replace(/ \)/g, ')')
    .replace(/\( /g, '(')
    .trim()
}

/** The conversion from one unit to another, `value · factor + offset`; null if they measure different things. */
export function relation(first, second) {
  for (const a of first) {
    for (const b of second) {
      if (!sameDimensions(a.powers, b.powers)) continue
      const factor = a.scale / b.scale
      return { factor, offset: a.offset === b.offset ? 0 : (a.offset - b.offset) / b.scale }
    }
  }
  return null
}

/** Whether two units measure the same; either may omit an angle. */
function sameDimensions(first, second) {
  const names = new Set([...Object.keys(first), ...Object.keys(second)])
  names.delete(ANGLE)
  names.delete(CYCLES)
  for (const name of names) if (Math.abs((first[name] ?? 0) - (second[name] ?? 0)) > 1e-9) return false
  const [a, b] = [angular(first), angular(second)]
  return a === 0 || b === 0 || a === b
}

/** The kind of angle in a unit; 0: none. */
const angular = (powers) => (powers[CYCLES] ? CYCLES : powers[ANGLE] ? ANGLE : 0)

/** Whether a unit contains an angle in radians (or degrees). */
export const hasAngle = (units) => units.some(({ powers }) => angular(powers) === ANGLE)

// --- reading

/** `wide`: everything after a solidus is in the denominator; `split`: no prefix before a power where there may be a unit. */
function parse(source, { wide = false, split = false }) {
  const reader = { text: source, index: 0, wide, split, depth: 0 }
  const unit = product(reader)
  return unit !== null && reader.index === source.length && Number.isFinite(unit.scale) && unit.scale > 0 ? unit : null
}

/** Factors with signs between them. */
function product(reader) {
  let unit = ONE
  let sign = 1
  let isFirst = true
  for (;;) {
    const char = reader.text[reader.index] ?? ''
    if (char === '/') {
      reader.index += 1
      sign = -1
    } else if (!isFirst && (char === '*' || char === ' ')) reader.index += 1
    else if (!isFirst && (char === '' || char === ')')) return unit
    const factor = group(reader)
    if (factor === null) return null
    if ((!isFirst || sign < 0) && (factor.offset || unit.offset)) return null // °C stands alone
    unit = multiply(unit, factor, sign)
    if (!reader.wide) sign = 1
    isFirst = false
  }
}

function group(reader) {
  let unit
  if (reader.text[reader.index] === '(') {
    if (++reader.depth > 5) return null
    reader.index += 1
    unit = product(reader)
    if (unit === null || reader.text[reader.index] !== ')') return null
    reader.index += 1
    reader.depth -= 1
  } else {
    const symbol = /^(?:°C|[°%‰'"]|\p{L}+|1(?![\d.]))/u.exec(reader.text.slice(reader.index))?.[0]
    if (symbol === undefined) return null
    reader.index += symbol.length
    if (symbol === '1') return ONE
    const power = exponent(reader)
    if (power === null) return null
    const parts = (reader.split && power !== 1 && apart(symbol)) || unitsOf(symbol)
    if (parts === null) return null
    // After units written together, an exponent belongs to the last.
    const last = raise(parts.at(-1), power)
    return parts.slice(0, -1).reduce((result, part) => multiply(result, part, 1), last)
  }
  const power = exponent(reader)
  return power === null ? null : raise(unit, power)
}

/** An exponent as written: `^2`, `^-1`, `^(1/2)`, `2`, `-1`; 1 if there is none; null if it is malformed. */
function exponent(reader) {
  const match = /^(?:\^(?:\(([-+]?\d+(?:\.\d+)?)(?:\/(\d+))?\)|([-+]?\d+(?:\.\d+)?))|([-+]?\d+))/.exec(reader.text.slice(reader.index))
  if (!match) return reader.text[reader.index] === '^' ? null : 1
  reader.index += match[0].length
  const power = Number(match[1] ?? match[3] ?? match[4]) / Number(match[2] ?? 1)
  return Number.isFinite(power) && Math.abs(power) <= 12 ? power : null
}

/** The units that a word stands for: one, or several written together (`Nm`, `kgm`). */
function unitsOf(word) {
  const name = Object.hasOwn(NAMES, word) ? NAMES[word] : word
  if (name.includes(' ')) return name.split(' ').map((part) => single(part))
  const whole = single(name)
  if (whole !== null) return [whole]
  if (word.length > 12) return null
  for (let end = word.length - 1; end > 0; end--) {
    const head = single(word.slice(0, end))
    const tail = head === null ? null : unitsOf(word.slice(end))
    if (tail !== null) return [head, ...tail]
  }
  return null
}

/** The units of a word that is none by itself, as few of them with a prefix as there may be; null if a unit comes twice: `mm` is a length. */
function apart(word) {
  if (word.length > 12 || Object.hasOwn(UNITS, word) || Object.hasOwn(NAMES, word)) return null
  for (let end = word.length - 1; end > 0; end--) {
    const [head, tail] = [word.slice(0, end), word.slice(end)]
    if (single(head) === null || head === tail) continue
    if (Object.hasOwn(UNITS, tail)) return [single(head), single(tail)]
    const rest = apart(tail)
    if (rest !== null) return [single(head), ...rest]
  }
  return null
}

/** A unit with or without a prefix. */
function single(symbol) {
  if (Object.hasOwn(UNITS, symbol)) return base(symbol, 1)
  for (const length of [1, 2]) {
    const prefix = symbol.slice(0, length)
    const rest = symbol.slice(length)
    if (Object.hasOwn(PREFIXES, prefix) && Object.hasOwn(UNITS, rest) && UNITS[rest][2]) return base(rest, Number(`1e${PREFIXES[prefix]}`))
  }
  return null
}

function base(symbol, prefix) {
  const [scale, powers, , offset = 0] = UNITS[symbol]
  return { scale: scale * prefix, offset, powers }
}

function multiply(first, second, sign) {
  const powers = { ...first.powers }
  for (const [name, power] of Object.entries(second.powers)) {
    powers[name] = (powers[name] ?? 0) + sign * power
    if (powers[name] === 0) delete powers[name]
  }
  const scale = sign > 0 ? first.scale * second.scale : first.scale / second.scale
  return { scale, offset: first.offset || (sign > 0 ? second.offset : 0), powers }
}

function raise(unit, power) {
  if (power === 1) return unit
  if (unit.offset) return { scale: Number.NaN, offset: 0, powers: {} } // no power of °C
  const powers = Object.fromEntries(Object.entries(unit.powers).map(([name, value]) => [name, value * power]))
  return { scale: unit.scale ** power, offset: 0, powers }
}
