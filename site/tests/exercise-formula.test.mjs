/** Formulas of exercises: what they are in JavaScript, and what is said of a text that is none. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { formulaCode } from '../js/exercise/formula.js'

const KNOWN = { names: ['h', 'g'], maths: ['sqrt', 'sin', 'min', 'atan2', 'hypot'] }

test('a formula is computed as it is read on paper', () => {
  for (const [text, value] of [
    ['2*g*h', 10],
    ['-h^2', -0.25],
    ['2^-h^2', 2 ** -0.25],
    ['2^3^2', 512],
    ['8/2/2 - -1', 3],
    ['sqrt(2·g·h) − ½', Math.sqrt(10) - 0.5],
    ['(g)**2', 100],
    ['min(h, 1e-1, .5)*007', 0.1 * 7],
    ['π*h²', Math.PI / 4],
    ['hypot(-h) + hypot(3, 0, 4)', 5.5],
    ['atan2(h, h)', Math.PI / 4],
  ]) {
    assert.equal(new Function(...KNOWN.names, `return ${formulaCode(text, KNOWN)}`)(0.5, 10), value, text)
  }
})

test('what cannot be read is said at its place', () => {
  for (const [text, problem, detail] of [
    ['', 'empty', ''],
    [' \n', 'empty', ''],
    ['2*', 'end', ''],
    ['sqrt(2*g', 'end', ''],
    ['2*)', 'rest', ')'],
    ['2*h)', 'rest', ')'],
    ['2 g h', 'rest', 'g h'],
    ['sin h', 'rest', 'h'],
    ['sqrt()', 'rest', ')'],
    ['9,81*h', 'rest', ',81*h'],
    ['sqrt(2*9,81*h)', 'rest', ',81*h)'],
    ['min(h)', 'rest', ')'],
    ['atan2(h, g, 1)', 'rest', ', 1)'],
    ['y = h', 'name', 'y'],
    ['h = 1', 'rest', '= 1'],
    ['constructor', 'name', 'constructor'],
    ['}) => {}, ({', 'rest', '}) => {}, ({'],
  ]) {
    assert.throws(() => formulaCode(text, KNOWN), { problem, detail }, text)
  }
})
