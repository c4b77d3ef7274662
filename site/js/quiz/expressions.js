/**
 * Reads a learner's entry for a number: a numeral or a calculation, perhaps followed by a unit.
 *
 *   readQuantity('1/12*0.3*(0.1^2+0.2^2) kg m²') → { value: 0.00125, unit: 'kg m^2', step: null }
 *
 * 1. Replace signs that mean the same by one of them (`normalise`).
 * 2. Parse and compute in one pass from left to right: + − · / ^, parentheses, functions of one argument, π, τ, e. Nothing is evaluated
 *    as code.
 * 3. The first name that is neither a function nor a constant begins the unit, which extends to the end.
 *
 * An ambiguous entry, such as `1,200`, `1·5`, `1/2π` or `3 e-3`, is refused.
 */

import { normalise, numeralEnd, readNumeral } from './numbers.js'

const LONGEST = 200 // characters
const DEEPEST = 60 // nested calls

/** What may be a calculation or a numeral: a raised point, and an exponent that is not raised any more; with both readings. */
const AMBIGUOUS = [
  { form: /^([-+−]?\d+)·(\d+)(?=$| ?[\p{L}°%])/u, readings: ['$1.$2', '$1*$2'] },
  { form: /^([-+−]?[\d.,]+) ?[·⋅×*xX] ?10 ?[-−](\d+)(?=$| ?[\p{L}°%])/u, readings: ['$1*10^-$2', '$1*10 - $2'] },
]

const CONSTANTS = { pi: Math.PI, π: Math.PI, tau: 2 * Math.PI, τ: 2 * Math.PI, e: Math.E }
const FUNCTIONS = {
  sqrt: Math.sqrt, cbrt: Math.cbrt, exp: Math.exp, ln: Math.log, abs: Math.abs, log10: Math.log10, lg: Math.log10, log2: Math.log2,
  sin: Math.sin, cos: Math.cos, tan: Math.tan, asin: Math.asin, acos: Math.acos, atan: Math.atan, arcsin: Math.asin, arccos: Math.acos,
  arctan: Math.atan, sinh: Math.sinh, cosh: Math.cosh, tanh: Math.tanh, asinh: Math.asinh, acosh: Math.acosh, atanh: Math.atanh,
}

/** Why a text cannot be read; `detail` is the part in question. */
class Unread extends Error {
  constructor(problem, detail = '', readings = []) {
    super(problem)
    this.problem = problem
    this.detail = detail
    this.readings = readings
  }
}

/**
 * @param {string} text
 * @returns {{value?: number, unit?: string, step?: number | null, problem?: string, detail?: string, readings?: string[]}} `step`: a unit
 *   of the last place of a numeral; null for a calculation. Problems: empty, long, end, sign, numeral, numbers,
 *   either, product, parenthesis, argument, log, finite
 */
export function readQuantity(text) {
  if (text.length > LONGEST) return { problem: 'long', detail: '', readings: [] }
  // `I = 0.08`, `≈ 3`: drop the name of the quantity.
  const source = normalise(text)
    .replace(/^(?:\p{L}[\p{L}\d_]*)? ?[=≈~] ?/u, '')
    .replace(/(\d) ?[.,;]$/, '$1')
  if (source === '') return { problem: 'empty', detail: '', readings: [] }
  for (const { form, readings } of AMBIGUOUS) {
    const [detail] = form.exec(text.trim()) ?? []
    if (detail) return { problem: 'either', detail, readings: readings.map((reading) => detail.replace(form, reading)) }
  }
  try {
    const reader = new Reader(source)
    const value = reader.sum()
    const unit = reader.rest()
    if (!Number.isFinite(value)) throw new Unread('finite')
    return { value, unit, step: stepOf(source.slice(0, source.length - unit.length)) }
  } catch (error) {
    if (!(error instanceof Unread)) throw error
    return { problem: error.problem, detail: error.detail.slice(0, 40), readings: error.readings }
  }
}

/** A unit of the last place of a numeral, which may have a power of ten; null for anything else. */
function stepOf(text) {
  const match = /^[-+ ]*([\d., '’]*\d)[.]?(?:[eE]([-+]?\d+)| ?[*xX] ?10 ?\^ ?[({]? ?([-+]?) ?(\d+) ?[)}]?)? ?[*]? ?$/.exec(text)
  if (!match) return null
  const numeral = readNumeral(match[1].trim())
  const exponent = Number(match[2] ?? `${match[3] ?? ''}${match[4] ?? 0}`)
  return numeral.problem ? null : numeral.step * 10 ** exponent
}

class Reader {
  #text
  #index = 0
  #inside = 0 // number of open parentheses
  #depth = 0 // number of nested calls

  constructor(text) {
    this.#text = text
  }

  sum() {
    let value = this.#product()
    for (;;) {
      if (this.#take('+')) value += this.#product()
      else if (this.#take('-')) value -= this.#product()
      else return value
    }
  }

  /** The unit after the value: the rest of the text. */
  rest() {
    const char = this.#peek()
    const remainder = this.#text.slice(this.#index)
    const unitStart = char === '/' ? this.#index + 1 : this.#index
    if (remainder === '' || this.#startsUnit(unitStart) || (/^1 ?\//.test(remainder) && this.#startsUnit(unitStart + 1, '/'))) return remainder
    throw new Unread(char === ')' ? 'parenthesis' : 'sign', remainder)
  }

  #product() {
    let value = this.#signed()
    let divided = false
    for (;;) {
      const char = this.#peek()
      const times = char === '*' || this.#isCross()
      if (times || char === '/') {
        if (this.#inside === 0 && this.#startsUnit(this.#index + 1)) {
          if (times) this.#index += 1
          return value
        }
        this.#index += 1
        const factor = this.#signed()
        value = times ? value * factor : value / factor
        divided = !times
      } else if (this.#startsValue()) {
        const start = this.#index
        if (/^1 ?\//.test(this.#text.slice(start)) && this.#inside === 0 && this.#startsUnit(start + 1, '/')) return value
        if (numeralEnd(this.#text, start) > start) throw new Unread('numbers', this.#text)
        if (/^e[-+]?\d/.test(this.#text.slice(start))) {
          const [before, after] = [this.#text.slice(0, start).trimEnd(), this.#text.slice(start)]
          throw new Unread('either', this.#text, [`${before}${after}`, `${before}*${after}`])
        }
        const factor = this.#power()
        if (divided) throw new Unread('product', this.#text.slice(0, this.#index))
        value *= factor
      } else return value
    }
  }

  #signed() {
    if (this.#take('-')) return -this.#deeper(() => this.#signed())
    if (this.#take('+')) return this.#deeper(() => this.#signed())
    return this.#power()
  }

  #power() {
    const base = this.#angle(this.#deeper(() => this.#atom()))
    if (!this.#take('^')) return base
    const braced = this.#take('{')
    const exponent = this.#deeper(() => this.#signed())
    if (braced && !this.#take('}')) throw new Unread('sign', this.#text.slice(this.#index))
    return base ** exponent
  }

  /** Convert a value in degrees in the argument of a function. */
  #angle(value) {
    if (this.#inside === 0) return value
    this.#skip()
    const [unit] = /^(?:°|deg(?:rees?)?(?!\p{L})|rad(?:ians?)?(?!\p{L}))/u.exec(this.#text.slice(this.#index)) ?? ['']
    this.#index += unit.length
    return /^[°d]/.test(unit) ? (value * Math.PI) / 180 : value
  }

  #atom() {
    if (this.#take('(')) return this.#closed()
    if (this.#take('√')) return Math.sqrt(this.#deeper(() => this.#atom()))
    this.#skip()
    const end = numeralEnd(this.#text, this.#index)
    if (end > this.#index) return this.#numeral(end)
    const name = this.#name(this.#index)
    if (name === 'log') throw new Unread('log')
    if (Object.hasOwn(CONSTANTS, name)) {
      this.#index += name.length
      return CONSTANTS[name]
    }
    if (Object.hasOwn(FUNCTIONS, name)) {
      this.#index += name.length
      if (!this.#take('(')) throw new Unread('argument', name)
      return FUNCTIONS[name](this.#closed())
    }
    throw new Unread(this.#peek() === '' ? 'end' : 'sign', this.#text.slice(this.#index))
  }

  /** The value up to the closing parenthesis. */
  #closed() {
    this.#inside += 1
    const value = this.#deeper(() => this.sum())
    if (!this.#take(')')) throw new Unread(this.#peek() === '' ? 'parenthesis' : 'sign', this.#text.slice(this.#index))
    this.#inside -= 1
    return value
  }

  #numeral(limit) {
    // `5 1/s`: the 1 belongs to the unit.
    const end = / 1$/.test(this.#text.slice(this.#index, limit)) && this.#startsUnit(limit, '/') ? limit - 2 : limit
    const digits = this.#text.slice(this.#index, end)
    const numeral = readNumeral(digits.replace(/[.]$/, ''))
    if (numeral.problem === 'numbers') throw new Unread('numbers', this.#text)
    if (numeral.problem) throw new Unread(numeral.problem, digits, numeral.readings)
    // `6.022 10^23`: no group of digits, but a power.
    if (/[ '’]/.test(digits) && /^ ?\^/.test(this.#text.slice(end))) throw new Unread('numbers', this.#text)
    const [exponent] = /^[eE][-+]?\d+/.exec(this.#text.slice(end)) ?? ['']
    this.#index = end + exponent.length
    const plain = String(numeral.value)
    return exponent === '' ? numeral.value : plain.includes('e') ? numeral.value * 10 ** Number(exponent.slice(1)) : Number(plain + exponent)
  }

  // --- signs

  #skip() {
    while (this.#text[this.#index] === ' ') this.#index += 1
  }

  #peek() {
    this.#skip()
    return this.#text[this.#index] ?? ''
  }

  #take(char) {
    if (this.#peek() !== char) return false
    this.#index += 1
    return true
  }

  #deeper(read) {
    this.#depth += 1
    if (this.#depth > DEEPEST) throw new Unread('long')
    const value = read()
    this.#depth -= 1
    return value
  }

  #name(index) {
    return /^(?:log10|log2|\p{L}+)/u.exec(this.#text.slice(index))?.[0] ?? ''
  }

  /** Whether an `x` here is a times sign: `1.2 x 10^-3`. */
  #isCross() {
    return /^[xX] ?[\d(]/.test(this.#text.slice(this.#index))
  }

  /** Whether a value begins here, rather than a sign or a unit. */
  #startsValue() {
    const char = this.#peek()
    return char === '(' || char === '√' || numeralEnd(this.#text, this.#index) > this.#index || isKnown(this.#name(this.#index))
  }

  /** Whether a unit begins at a place, after `sign` if one is given. */
  #startsUnit(index, sign = '') {
    while (this.#text[index] === ' ') index += 1
    if (sign !== '' && this.#text[index] !== sign) return false
    if (sign !== '') index += 1
    while (this.#text[index] === ' ') index += 1
    const name = this.#name(index)
    return name !== '' ? !isKnown(name) : /[°%‰'"]/.test(this.#text[index] ?? '')
  }
}

const isKnown = (name) => Object.hasOwn(CONSTANTS, name) || Object.hasOwn(FUNCTIONS, name) || name === 'log'
