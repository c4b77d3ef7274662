/**
 * What a learner enters for a number: a numeral or a calculation, and behind it perhaps a unit.
 *
 *   readQuantity('1/12*0.3*(0.1^2+0.2^2) kg m²') → { value: 0.00125, unit: 'kg m^2', step: null }
 *
 * 1. Signs that mean the same become one (`normalise`).
 * 2. One walk from left to right parses and computes: + − · / ^, parentheses, functions of one argument, π, τ, e. Nothing is evaluated
 *    as code.
 * 3. The first name that is no function and no constant begins the unit, which goes on to the end.
 *
 * What can be read in two ways is not guessed: `1,200`, `1/2π`, and `3 e-3`.
 */

import { normalise, numeralEnd, readNumeral } from './numbers.js'

const LONGEST = 200 // characters
const DEEPEST = 60 // calls inside each other

const CONSTANTS = { pi: Math.PI, π: Math.PI, tau: 2 * Math.PI, τ: 2 * Math.PI, e: Math.E }
const FUNCTIONS = {
  sqrt: Math.sqrt, cbrt: Math.cbrt, exp: Math.exp, ln: Math.log, abs: Math.abs, log10: Math.log10, lg: Math.log10, log2: Math.log2,
  sin: Math.sin, cos: Math.cos, tan: Math.tan, asin: Math.asin, acos: Math.acos, atan: Math.atan, arcsin: Math.asin, arccos: Math.acos,
  arctan: Math.atan, sinh: Math.sinh, cosh: Math.cosh, tanh: Math.tanh, asinh: Math.asinh, acosh: Math.acosh, atanh: Math.atanh,
}

/** Why a text cannot be read; `detail` is the part of it that is meant. */
class Unread extends Error {
  constructor(problem, detail = '', readings = []) {
    super(problem)
    Object.assign(this, { problem, detail, readings })
  }
}

/**
 * @param {string} text
 * @returns {{value: number, unit: string, step: number | null} | {problem: string, detail: string, readings: string[]}} `step`: a unit
 *   of the last place that was written, for a numeral; null for a calculation. Problems: empty, long, end, sign, numeral, numbers,
 *   comma, product, parenthesis, argument, log, finite
 */
export function readQuantity(text) {
  if (text.length > LONGEST) return { problem: 'long', detail: '', readings: [] }
  // `I = 0.08`, `≈ 3`: what is named there is what is asked for.
  const source = normalise(text)
    .replace(/^(?:\p{L}[\p{L}\d_]*)? ?[=≈~] ?/u, '')
    .replace(/(\d) ?[.,;]$/, '$1')
  if (source === '') return { problem: 'empty', detail: '', readings: [] }
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

/** A unit of the last place of a numeral, with a power of ten perhaps; null for anything else. */
function stepOf(text) {
  const found = /^[-+ ]*([\d., '’]*\d)[.]?(?:[eE]([-+]?\d+)| ?[*xX] ?10 ?\^ ?[({]? ?([-+]?) ?(\d+) ?[)}]?)? ?[*]? ?$/.exec(text)
  if (!found) return null
  const read = readNumeral(found[1].trim())
  const exponent = Number(found[2] ?? `${found[3] ?? ''}${found[4] ?? 0}`)
  return read.problem ? null : read.step * 10 ** exponent
}

class Reader {
  #text
  #at = 0
  #inside = 0 // so many parentheses are open
  #depth = 0 // so many calls are in each other

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

  /** The unit behind the value: whatever is left. */
  rest() {
    const char = this.#peek()
    const left = this.#text.slice(this.#at)
    const begins = char === '/' ? this.#at + 1 : this.#at
    if (left === '' || this.#startsUnit(begins) || (/^1 ?\//.test(left) && this.#startsUnit(begins + 1, '/'))) return left
    throw new Unread(char === ')' ? 'parenthesis' : 'sign', left)
  }

  #product() {
    let value = this.#signed()
    let divided = false
    for (;;) {
      const char = this.#peek()
      const times = char === '*' || this.#isCross()
      if (times || char === '/') {
        if (this.#inside === 0 && this.#startsUnit(this.#at + 1)) {
          if (times) this.#at += 1
          return value
        }
        this.#at += 1
        const factor = this.#signed()
        value = times ? value * factor : value / factor
        divided = !times
      } else if (this.#startsValue()) {
        const from = this.#at
        if (/^1 ?\//.test(this.#text.slice(from)) && this.#inside === 0 && this.#startsUnit(from + 1, '/')) return value
        if (numeralEnd(this.#text, from) > from) throw new Unread('numbers', this.#text)
        if (/^e[-+]?\d/.test(this.#text.slice(from))) throw new Unread('product', this.#text)
        const factor = this.#power()
        if (divided) throw new Unread('product', this.#text.slice(0, this.#at))
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
    if (braced && !this.#take('}')) throw new Unread('sign', this.#text.slice(this.#at))
    return base ** exponent
  }

  /** Degrees in the argument of a function. */
  #angle(value) {
    if (this.#inside === 0) return value
    this.#skip()
    const [unit] = /^(?:°|deg(?:rees?)?(?!\p{L})|rad(?:ians?)?(?!\p{L}))/u.exec(this.#text.slice(this.#at)) ?? ['']
    this.#at += unit.length
    return /^[°d]/.test(unit) ? (value * Math.PI) / 180 : value
  }

  #atom() {
    if (this.#take('(')) return this.#closed()
    if (this.#take('√')) return Math.sqrt(this.#deeper(() => this.#atom()))
    this.#skip()
    const end = numeralEnd(this.#text, this.#at)
    if (end > this.#at) return this.#numeral(end)
    const name = this.#name(this.#at)
    if (name === 'log') throw new Unread('log')
    if (Object.hasOwn(CONSTANTS, name)) {
      this.#at += name.length
      return CONSTANTS[name]
    }
    if (Object.hasOwn(FUNCTIONS, name)) {
      this.#at += name.length
      if (!this.#take('(')) throw new Unread('argument', name)
      return FUNCTIONS[name](this.#closed())
    }
    throw new Unread(this.#peek() === '' ? 'end' : 'sign', this.#text.slice(this.#at))
  }

  /** What stands up to the closing parenthesis. */
  #closed() {
    this.#inside += 1
    const value = this.#deeper(() => this.sum())
    if (!this.#take(')')) throw new Unread(this.#peek() === '' ? 'parenthesis' : 'sign', this.#text.slice(this.#at))
    this.#inside -= 1
    return value
  }

  #numeral(found) {
    // `5 1/s`: the 1 belongs to the unit.
    const end = / 1$/.test(this.#text.slice(this.#at, found)) && this.#startsUnit(found, '/') ? found - 2 : found
    const digits = this.#text.slice(this.#at, end)
    const read = readNumeral(digits.replace(/[.]$/, ''))
    if (read.problem) throw new Unread(read.problem, digits, read.readings)
    const [exponent] = /^[eE][-+]?\d+/.exec(this.#text.slice(end)) ?? ['']
    this.#at = end + exponent.length
    const plain = String(read.value)
    return exponent === '' ? read.value : plain.includes('e') ? read.value * 10 ** exponent.slice(1) : Number(plain + exponent)
  }

  // --- signs

  #skip() {
    while (this.#text[this.#at] === ' ') this.#at += 1
  }

  #peek() {
    this.#skip()
    return this.#text[this.#at] ?? ''
  }

  #take(char) {
    if (this.#peek() !== char) return false
    this.#at += 1
    return true
  }

  #deeper(read) {
    this.#depth += 1
    if (this.#depth > DEEPEST) throw new Unread('long')
    const value = read()
    this.#depth -= 1
    return value
  }

  #name(at) {
    return /^(?:log10|log2|\p{L}+)/u.exec(this.#text.slice(at))?.[0] ?? ''
  }

  /** Whether an `x` here is a times sign: `1.2 x 10^-3`. */
  #isCross() {
    return /^[xX] ?[\d(]/.test(this.#text.slice(this.#at))
  }

  /** Whether a value begins here, rather than a sign or a unit. */
  #startsValue() {
    const char = this.#peek()
    return char === '(' || char === '√' || numeralEnd(this.#text, this.#at) > this.#at || isKnown(this.#name(this.#at))
  }

  /** Whether a unit begins at a place, behind a sign perhaps. */
  #startsUnit(at, sign = '') {
    while (this.#text[at] === ' ') at += 1
    if (sign !== '' && this.#text[at] !== sign) return false
    if (sign !== '') at += 1
    while (this.#text[at] === ' ') at += 1
    const name = this.#name(at)
    return name !== '' ? !isKnown(name) : /[°%‰'"]/.test(this.#text[at] ?? '')
  }
}

const isKnown = (name) => Object.hasOwn(CONSTANTS, name) || Object.hasOwn(FUNCTIONS, name) || name === 'log'
