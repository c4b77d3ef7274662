/**
 * A formula as a reader writes it, read and put into JavaScript. In it stands nothing but numbers, signs, brackets and the names that it may
 * use, so that what is wrong can be said before anything runs.
 */

import { normalise } from '../quiz/numbers.js'

const TOKEN = /(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[\p{L}_][\p{L}\d_]*|\S/gu

/** Why a formula cannot be read: it is `empty`, it has no `end`, a `name` is unknown, or from `detail` on it is none (`rest`). */
class FormulaError extends SyntaxError {
  constructor(problem, detail = '') {
    super(detail === '' ? 'the formula is not complete' : `the formula cannot be read from "${detail}" on`)
    this.problem = problem
    this.detail = detail
  }
}

/**
 * @param {string} text @param {{names: string[], maths: string[]}} known its variables, and the functions of `Math` that it may call
 * @returns {string} the same in JavaScript
 * @throws {FormulaError}
 */
export function formulaCode(text, { names, maths }) {
  const source = normalise(text)
  const tokens = [...source.matchAll(TOKEN)]
  let next = 0
  const take = (...signs) => (signs.includes(tokens[next]?.[0]) ? tokens[next++][0] : '')
  const stop = () => {
    throw next < tokens.length ? new FormulaError('rest', source.slice(tokens[next].index)) : new FormulaError(next > 0 ? 'end' : 'empty')
  }
  const close = () => take(')') || stop()
  const chain = (read, ...signs) => {
    let code = read()
    for (let sign = take(...signs); sign; sign = take(...signs)) code += sign + read()
    return code
  }
  const sum = () => chain(product, '+', '-')
  const product = () => chain(signed, '*', '/', '%')
  const signed = () => {
    const sign = take('+', '-')
    return sign ? `(${sign}${signed()})` : power()
  }
  const power = () => {
    const base = atom()
    return take('^') ? `(${base}**${signed()})` : base
  }
  const atom = () => {
    if (take('(')) return `(${sum()}${close()}`
    const [name] = tokens[next] ?? stop()
    if (take(...names)) return name
    if (take('pi', 'π')) return 'Math.PI'
    if (take(...maths)) return `Math.${name}${take('(') || stop()}${list(name)}${close()}`
    if (/^[\p{L}_]/u.test(name)) throw new FormulaError('name', name)
    if (!/\d/.test(name)) stop()
    next += 1
    return String(Number(name))
  }
  /** The arguments of a function: one, two of `atan2`, any number of `hypot`, at least two of `max` and `min`. */
  const list = (name) => {
    if (name === 'hypot') return chain(sum, ',')
    if (Math[name].length === 1) return sum()
    return sum() + (take(',') || stop()) + (name === 'atan2' ? sum() : chain(sum, ','))
  }
  const code = sum()
  if (next < tokens.length) stop()
  return code
}
