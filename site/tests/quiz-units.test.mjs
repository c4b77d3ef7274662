/** Units, and how they hang together. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { hasAngle, plain, readUnit, relation } from '../js/quiz/units.js'

const factor = (given, asked) => relation(readUnit(given), readUnit(asked))?.factor
const same = (one, other, expected = 1) => {
  const found = factor(one, other)
  assert.ok(found !== undefined && Math.abs(found / expected - 1) < 1e-12, `${one} in ${other}: ${found}`)
}
const different = (one, other) => assert.equal(relation(readUnit(one), readUnit(other)), null, `${one} and ${other}`)

test('the same unit in many ways', () => {
  for (const text of ['kg m^2', 'kg·m²', 'kg*m^2', 'kg m2', 'kgm^2', 'kg⋅m^{2}', 'kg × m²', 'm^2 kg', 'kg m m', 'Kg m²',
    '\\mathrm{kg\\,m^2}', 'kg \\cdot m^2', '$kg~m^2$', 'N m s^2',
    'J s²', 'J/(1/s²)', 'kilogram metres^2', 'kg.m^2', 'kg m ^ 2', 'kg m**2', ' kg  m² ']) same(text, 'kg m^2')
  for (const text of ['m/s', 'm s^-1', 'm·s⁻¹', 'm s-1', 'm/s^1', 'm * s^-1', 'meters per second', 'm / s', 'm (s)^-1',
    '(m/s)']) same(text, 'm/s')
  for (const text of ['rad/s', '1/s', 's^-1', '/s', 'rad s⁻¹', 'rads^-1', 'radians per second']) same(text, 'rad/s')
  for (const text of ['N', 'kg m/s²', 'kg m s^-2', 'newton', 'J/m']) same(text, 'N')
  for (const text of ['Ω', 'Ω', 'ohm', 'V/A', '\\Omega']) same(text, 'Ω')
  for (const text of ['µm', 'μm', 'um', '\\mu m', '\\mu{}m']) same(text, 'm', 1e-6)
  for (const text of ['J/(kg K)', 'J kg^-1 K^-1', 'J/kg/K', 'J/kg K', 'J/(kg·K)']) same(text, 'J/(kg K)')
})

test('scales', () => {
  same('g cm^2', 'kg m^2', 1e-7)
  same('kg m^2', 'g cm^2', 1e7)
  same('mm', 'm', 1e-3)
  same('mm^2', 'm^2', 1e-6)
  same('cm³', 'l', 1e-3)
  same('km/h', 'm/s', 1 / 3.6)
  same('kWh', 'J', 3.6e6)
  same('MPa', 'N/mm²', 1)
  same('ms', 's', 1e-3)
  same('min', 's', 60)
  same('t', 'kg', 1000)
  same('ft', 'inches', 12)
  same('mi', 'km', 1.609344)
  same('lb', 'kg', 0.45359237)
  same('psi', 'Pa', 6894.757293168361)
  same('eV', 'J', 1.602176634e-19)
  same('bar', 'Pa', 1e5)
  same('%', '', 0.01)
  same('dag', 'g', 10)
  same('mrad', 'deg', 180 / Math.PI / 1000)
  same('turn', 'rad', 2 * Math.PI)
  same('rpm', 'rad/s', Math.PI / 30)
  same('µV/Hz^0.5', 'V/Hz^(1/2)', 1e-6)
  same('°', 'rad', Math.PI / 180)
  same("'", '°', 1 / 60)
})

test('a word is a unit before it is several', () => {
  different('ms', 'm s')
  same('Nm', 'N m')
  same('mNm', 'N m', 1e-3)
  same('kgm2/s2', 'J')
  same('Ws', 'J')
  same('min', 's', 60) // not milli-inch
  same('cd', 'cd') // not centi-day
  same('Pa', 'Pa')
  same('mm', 'm', 1e-3)
})

test('what measures something else does not fit', () => {
  for (const [one, other] of [['kg m', 'kg m^2'], ['m', 's'], ['N', 'N m'], ['rad', 'm'], ['Hz', 'rad/s'], ['rad/s', 'Hz'], ['K', '°'],
    ['', 'kg'], ['kg', ''], ['m^2', 'm'], ['%', 'kg']]) different(one, other)
})

test('angles can be left out, hertz are no radians a second', () => {
  same('N m/rad', 'N m')
  same('s^-1', 'Hz')
  same('1/s', 'rad/s')
  same('rad', '')
  same('deg/s', '1/s', Math.PI / 180)
  assert.equal(hasAngle(readUnit('rad/s')), true)
  assert.equal(hasAngle(readUnit('deg')), true)
  assert.equal(hasAngle(readUnit('Hz')), false)
  assert.equal(hasAngle(readUnit('kg')), false)
})

test('degrees Celsius have another zero', () => {
  assert.deepEqual(relation(readUnit('°C'), readUnit('K')), { factor: 1, offset: 273.15 })
  assert.deepEqual(relation(readUnit('K'), readUnit('°C')), { factor: 1, offset: -273.15 })
  assert.deepEqual(relation(readUnit('mK'), readUnit('°C')), { factor: 1e-3, offset: -273.15 })
  assert.deepEqual(relation(readUnit('° C'), readUnit('degC')), { factor: 1, offset: 0 })
  for (const text of ['°C/s', 'J/°C', '°C^2', 'kg °C', '°C^-1']) assert.deepEqual(readUnit(text), [], text)
})

test('what is no unit is none', () => {
  for (const text of ['smoot', 'foo', 'kg + m', 'm^', 'm^x', 'kg//m', '/', '(', ')', 'kg)', '(kg', 'm^99', 'm^1/2/', '2 kg', 'kg 2',
    '__proto__', 'constructor', 'toString', 'hasOwnProperty',
    '('.repeat(50), 'm'.repeat(99), '/'.repeat(99), 'kg^'.repeat(30), '\u0000', '💥', 'ﬀ', 'm^-',
      '1/']) assert.deepEqual(readUnit(text), [], text)
  assert.equal(readUnit('').length, 1)
})

test('units that nobody knows are compared as text', () => {
  assert.equal(plain('widgets · h⁻¹'), plain('widgets*h^-1'))
  assert.equal(plain('{a}'), 'a')
})

test('any unit fits itself, and back and forth is nothing', () => {
  let seed = 5
  const random = (n) => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff
    return (seed >> 8) % n
  }
  const symbols = ['m', 'kg', 's', 'A', 'K', 'N', 'J', 'mm', 'km', 'g', 'mol', 'W', 'V', 'rad', 'deg', 'min', 'kPa', 'µm', 'C', 'T']
  for (let i = 0; i < 3000; i++) {
    const parts = Array.from({ length: 1 + random(4) }, () => symbols[random(symbols.length)] + ['', '^2', '^-1', '³', '^(1/2)',
      '^-2'][random(6)])
    const text = parts.join([' ', '*', '·'][random(3)])
    same(text, text)
    same(text, [...parts].reverse().join(' '))
    const other = `${text} ${symbols[random(symbols.length)]}`
    const there = factor(text, other)
    if (there !== undefined) assert.ok(Math.abs(there * factor(other, text) - 1) < 1e-9, `${text} and ${other}`)
  }
})

test('any text at all is read or refused', () => {
  let seed = 9
  const random = (n) => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff
    return (seed >> 8) % n
  }
  const pieces = [...'kgmsNJ/*^() -12°{}\\', 'cdot', 'mathrm', '²', '⁻¹', 'µ', '°C', '.', ' per ']
  for (let i = 0; i < 20000; i++) {
    const text = Array.from({ length: random(12) }, () => pieces[random(pieces.length)]).join('')
    for (const unit of readUnit(text)) assert.ok(unit.scale > 0 && Number.isFinite(unit.scale), text)
  }
})
