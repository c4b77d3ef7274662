/** Numbers and calculations as learners enter them. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { readQuantity } from '../js/quiz/expressions.js'
import { normalise, numeralEnd, readNumeral } from '../js/quiz/numbers.js'

/** Pseudo-random numbers that are the same each time (mulberry32). */
export function chance(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed)
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296
  }
}

const value = (text) => {
  const read = readQuantity(text)
  assert.equal(read.problem, undefined, `${text}: ${read.problem} ${read.detail}`)
  return read.value
}
const problem = (text) => readQuantity(text).problem
const near = (text, expected) => assert.ok(Math.abs(value(text) - expected) <= 1e-12 * Math.abs(expected), `${text}: ${value(text)}`)

test('numerals', () => {
  const cases = {
    0.08: ['0.08', '0,08', '.08', ',08', '8e-2', '8E-2', '8·10^-2', '8 × 10⁻²', '8*10**-2', '8x10^-2', '0.8e-1', '0.080', '٠٫٠٨', '０．０８',
      ' 0.08 '],
    1200: ['1200', '1 200', '1\u202f200', '1\u00a0200', '1\u2009200', "1'200", '1’200', '1200.', '1.200e3', '1200,0', '1.2e+3', '1 200.0'],
    1234567.5: ['1234567.5', '1 234 567,5', '1,234,567.5', '1.234.567,5', "1'234'567.5", '12345675e-1'],
    1234567: ['1,234,567', '1.234.567', '1 234 567'],
    '-0.25': ['-0.25', '−0.25', '–0,25', '- 0.25', '-.25', '--(-.25)', '-1/4'],
    0.001: ['1e-3', '1e−3', '0.001', '0,001', '0.000 001e3'],
    1234.567: ['1234,567', '1234.567', '1 234,567', '1 234.567'],
    12.345: ['12.345'],
    1.5: ['1½', '1 ½', '1+½', '3·½', '3/2', '١٫٥', '۱٫۵', '१.५', '1，5', '١،٥'],
    0.5: ['½', '+½', '½ m', '1⁄2'],
    '-1200.5': ['-1200½', '−1 200½', '—1200.5'],
    6.022e23: ['6.022·10²³', '6.022 • 10²³', '6.022⨯10^(23)'],
  }
  for (const [expected, texts] of Object.entries(cases)) for (const text of texts) near(text, Number(expected))
})

test('a comma that may separate thousands is asked about, and no other one', () => {
  assert.deepEqual(readQuantity('1,200'), { problem: 'either', detail: '1,200', readings: ['1200', '1.200'] })
  for (const text of ['1,200', '12,345', '999,000', '1,200e3', '3*1,200', '1,200 kg']) assert.equal(problem(text), 'either', text)
  for (const text of ['0,200', '1,20', '1,2000', '1234,200', '1,200.0', '1,200,000', '00,123']) assert.equal(problem(text), undefined, text)
})

test('what is no numeral is said to be none', () => {
  for (const text of ['1.2.3', '1,2,3', '1,23,456', '1.2,3.4', '1,234.5.6', '1.234,567,8',
    '12.34.567']) assert.equal(problem(text), 'numeral', text)
  for (const text of ['1 2', '1 20', '12 34 567', '1200 000', '2 3.5', '0.12 34 5', '2 pi 3', '1e-3.5',
    '1 1/2', '6.022 10^23', '6.022 10²³', '6 10^23',
    '(2)3']) assert.equal(problem(text), 'numbers', text)
})

test('calculations', () => {
  const cases = {
    '2*pi*0.05': 0.1 * Math.PI,
    '2π·0,05': 0.1 * Math.PI,
    'sqrt(2)/3': Math.SQRT2 / 3,
    '√2/3': Math.SQRT2 / 3,
    '√(2)/3': Math.SQRT2 / 3,
    '1/12*0.3*(0.1^2+0.2^2)': 0.00125,
    '1/12·0,3·(0,1²+0,2²)': 0.00125,
    '-2^2': -4,
    '(-2)^2': 4,
    '2^-3': 0.125,
    '2^3^2': 512,
    '10⁻³': 1e-3,
    '10^{-3}': 1e-3,
    '2(3+4)': 14,
    '(1+2)(3+4)': 21,
    '2 sqrt(9)': 6,
    '2 - -3': 5,
    '6/3/2': 1,
    '6/3*2': 4,
    'exp(1)': Math.E,
    e: Math.E,
    'e^2': Math.E ** 2,
    'τ/2': Math.PI,
    'tau': 2 * Math.PI,
    'ln(e^3)': 3,
    'log10(1000)': 3,
    'lg(1000)': 3,
    'log2(8)': 3,
    'cbrt(27)': 3,
    'abs(-3)': 3,
    'sin(30°)': 0.5,
    'cos(60 deg)': 0.5,
    'sin(pi/6)': 0.5,
    'sin(0.5235987755982988 rad)': 0.5,
    'arctan(1)': Math.PI / 4,
    'atan(1)*4': Math.PI,
    'I = 2*3': 6,
    'omega_1 ≈ 2*3': 6,
    '= 6': 6,
  }
  for (const [text, expected] of Object.entries(cases)) near(text, expected)
})

test('what can be read in two ways is not guessed', () => {
  for (const text of ['1/2π', '1/2pi', '1/2 pi', '6/2(1+2)', '1/2 sqrt(3)']) assert.equal(problem(text), 'product', text)
  const twice = {
    '3 e-3': ['3e-3', '3*e-3'], '3 e3': ['3e3', '3*e3'], '1·5': ['1.5', '1*5'], '−1·5 m': ['−1.5', '−1*5'],
    '1.2 × 10−3 m': ['1.2*10^-3', '1.2*10 - 3'],
  }
  for (const [text, readings] of Object.entries(twice)) {
    assert.deepEqual(readQuantity(text).readings, readings, text)
    for (const reading of readings) if (reading !== '3*e3') assert.equal(problem(reading), undefined, reading)
  }
  near('1·10^-3', 1e-3)
  near('1/(2π)', 1 / (2 * Math.PI))
  near('1/2*pi', Math.PI / 2)
  assert.equal(problem('log(2)'), 'log')
})

test('what is wrong with a calculation is named', () => {
  const cases = {
    '': 'empty', '   ': 'empty', '=': 'empty', '2*': 'end', '-': 'end', '2^': 'end', '(': 'end', '(1': 'parenthesis',
      '((1)': 'parenthesis', '1)': 'parenthesis',
    '2.5½': 'numbers', '1 20½': 'numbers',
    'sqrt 2': 'argument', 'sqrt2': 'argument', 'sin 30°': 'argument', 'sqrt()': 'sign', '2**': 'end', '*2': 'sign', '2//3': 'sign',
      'kg': 'sign',
    '1/0': 'finite', 'sqrt(-1)': 'finite', 'ln(0)': 'finite', '0/0': 'finite', '1e400': 'finite', '10^999': 'finite',
      '(-8)^(1/3)': 'finite',
    '2;3': 'sign', '2!': 'sign', '2 & 3': 'sign', '0x10': undefined,
  }
  for (const [text, expected] of Object.entries(cases)) if (expected) assert.equal(problem(text), expected, text)
  assert.equal(readQuantity('2!').detail, '!')
})

test('the unit is what is left, and begins with the first name that is no function', () => {
  const cases = {
    '0.08 kg m^2': 'kg m^2', '0.08kg·m²': 'kg*m^2', '0.08 * kg': 'kg', '5 m/s': 'm/s', '5/s': '/s', '5 / s': '/ s', '5 1/s': '1/s',
      '30°': '°', "45'": "'",
    '12 %': '%', '2 pi rad/s': 'rad/s', '3 eV': 'eV', '3 e V': 'V', '2 µm': 'μm', '(1+2) m': 'm', 'sin(30°) m': 'm', '1e-3kg': 'kg',
      '5 exp': 'none', '2 x': 'x',
    '7': '', '3 N / 2 kg': 'N / 2 kg',
  }
  for (const [text, unit] of Object.entries(cases)) if (unit !== 'none') assert.equal(readQuantity(text).unit, unit, text)
})

test('the last place that was written is known for numerals alone', () => {
  const step = (text) => readQuantity(text).step
  const cases = { '0.08': 0.01, '0,080': 0.001, '80': 1, '1 200': 1, '1e-3': 1e-3, '1.2e-3': 1e-4, '1.2·10^-3': 1e-4,
    '1.2*10^(-3) m': 1e-4, '-3.5 kg': 0.1, '1.2 x 10^3': 100 }
  for (const [text, expected] of Object.entries(cases)) assert.ok(Math.abs(step(text) / expected - 1) < 1e-12, `${text}: ${step(text)}`)
  for (const text of ['2*3', 'pi', '(0.08)', '1/4', 'sqrt(2)', '2·3^2']) assert.equal(step(text), null, text)
})

test('nothing is run as code, whatever is entered', () => {
  const hostile = [
    'alert(1)', 'constructor', 'toString', '__proto__', 'hasOwnProperty(1)', 'valueOf', 'process.exit(1)', 'globalThis', '${1+1}', '`1`',
      '<img src=x onerror=alert(1)>',
    '"1"', "'; drop table", '1;2', '\u0000', '\ud800', '\u202e12', '💥', '∞', 'NaN', 'Infinity', '1e999999999',
      '9'.repeat(200), '-'.repeat(199) + '1', '('.repeat(199),
    '('.repeat(100) + '1' + ')'.repeat(99), '√'.repeat(199), '2^'.repeat(99) + '2',
      'sin('.repeat(49), '1'.repeat(201), 'é'.repeat(200), '1 '.repeat(99), ','.repeat(200), '.', '..', ',', '1.,', '1,.', 'e-', 'e+5',
      '1e', '1e+', '²', '^2', '2^²', '٫', '°', '%',
  ]
  for (const text of hostile) {
    const read = readQuantity(text)
    assert.ok(read.problem !== undefined || Number.isFinite(read.value), text)
    assert.equal(({}).polluted, undefined)
  }
  assert.equal(problem('('.repeat(150)), 'long')
  assert.equal(problem('1'.repeat(201)), 'long')
  assert.equal(problem('constructor'), 'sign')
  assert.equal(problem('constructor(1)'), 'sign')
})

test('any text at all is read or refused', () => {
  const random = chance(7)
  const pieces = [...'0123456789.,+-*/^() eE\'°πx√', 'sqrt(', 'pi', 'kg', 'm²', '10^-', ' ', '·', '−', '1 200', '1,200', '\u0000', 'ß',
    '{', '}', '=', 'log', 'deg', '½']
  for (let i = 0; i < 5000; i++) {
    const text = Array.from({ length: 1 + Math.floor(random() * 14) }, () => pieces[Math.floor(random() * pieces.length)]).join('')
    const read = readQuantity(text)
    assert.ok(read.problem ? typeof read.problem === 'string' : Number.isFinite(read.value), text)
  }
})

test('a calculation gives what JavaScript gives for it', () => {
  const random = chance(11)
  const number = () => (random() * 10).toFixed(1 + Math.floor(random() * 3))
  const make = (depth) => {
    const kind = depth > 3 ? 0 : Math.floor(random() * 6)
    if (kind <= 1) return number()
    if (kind === 2) return `(${make(depth + 1)})`
    if (kind === 3) return `sqrt(${number()})`
    const sign = '+-*/'[Math.floor(random() * 4)]
    return `${make(depth + 1)} ${sign} ${make(depth + 1)}`
  }
  let read = 0
  for (let i = 0; i < 3000; i++) {
    const text = make(0)
    if (text.length > 200) continue
    const expected = Function(`return ${text.replaceAll('sqrt', 'Math.sqrt')}`)()
    const found = readQuantity(text)
    if (!Number.isFinite(expected)) assert.equal(found.problem, 'finite', text)
    else assert.ok(Math.abs(found.value - expected) <= 1e-9 * Math.max(1, Math.abs(expected)), text)
    read += 1
  }
  assert.ok(read > 2000)
})

test('a number is read back in every way to write it', () => {
  const random = chance(3)
  const group = (digits, sign) => digits.replace(/\B(?=(\d{3})+$)/g, sign)
  for (let i = 0; i < 3000; i++) {
    const whole = String(Math.floor(random() * 10 ** (1 + Math.floor(random() * 9))))
    const part = String(Math.floor(random() * 1e6)).padStart(6, '0').slice(0, 1 + Math.floor(random() * 6))
    const expected = Number(`${whole}.${part}`)
    const ways = [`${whole}.${part}`, `${expected}e0`]
    ways.push(`${group(whole, ' ')}.${part}`, `${group(whole, ' ')},${part}`, `${group(whole, "'")}.${part}`)
    if (whole.length > 3) ways.push(`${group(whole, ',')}.${part}`, `${group(whole, '.')},${part}`, `${whole},${part}`)
    for (const text of ways) if (problem(text) !== 'either') assert.equal(value(text), expected, text)
    if (problem(`${whole},${part}`) === 'either') assert.ok(/^[1-9]\d{0,2},\d{3}$/.test(`${whole},${part}`))
  }
})

test('signs are made one', () => {
  assert.equal(normalise(' 2\u00a0·\u200910⁻³ '), '2 * 10^-3')
  assert.equal(normalise('−1÷2'), '-1/2')
  assert.equal(numeralEnd('12.5kg', 0), 4)
  assert.equal(numeralEnd('kg', 0), 0)
  assert.deepEqual(readNumeral('12,5'), { value: 12.5, step: 0.1 })
})
