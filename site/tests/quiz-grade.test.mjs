/** Grading, and what is said of a near miss. */

import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import { test } from 'node:test'
import { gradeChoice, gradeNumber, gradeOrder, isWithin, nearMiss } from '../js/quiz/grade.js'
import { moveBy, placeAt, moveTo, restoreOrder } from '../js/quiz/ordering.js'
import { compareBy, gradeOutput, lastPlace } from '../js/quiz/output.js'

const INERTIA = { answer: 0.08, tolerance: 0.0001, unit: 'kg m^2' }
const say = (text, asked) => {
  const { state, slip: near, problem } = gradeNumber(text, asked)
  return [state, near ?? problem].filter(Boolean).join(' ')
}

test('choices', () => {
  assert.deepEqual(gradeChoice(['a'], ['a']), { right: true, extra: 0, missing: 0 })
  assert.deepEqual(gradeChoice(['b'], ['a']), { right: false, extra: 1, missing: 1 })
  assert.deepEqual(gradeChoice(['c', 'a'], ['a', 'c']), { right: true, extra: 0, missing: 0 })
  assert.deepEqual(gradeChoice(['a', 'b'], ['a', 'c', 'd']), { right: false, extra: 1, missing: 2 })
  assert.deepEqual(gradeChoice(['a', 'a'], ['a']), { right: true, extra: 0, missing: 0 })
  assert.deepEqual(gradeChoice([], ['a']), { right: false, extra: 0, missing: 1 })
})

test('a number in every way that is right', () => {
  for (const text of ['0.08', '0,08', '8e-2', '8·10^-2', '2*1*0.2^2', '0.08 kg m^2', '0.08 kg·m²', '800 kg cm^2', '8e5 g cm²', '80 g m^2',
    '0.08 N m s^2', '0.0801', '0.0799', '=0.08', 'I = 0.08', '1/12.5']) {
    assert.equal(say(text, INERTIA), 'right', text)
  }
  assert.equal(gradeNumber('0.08', INERTIA).converted, false)
  assert.equal(gradeNumber('2*0.04', INERTIA).converted, true)
  assert.equal(gradeNumber('800 kg cm^2', INERTIA).converted, true)
})

test('a near miss is named', () => {
  const cases = {
    '-0.08': 'sign', '0.8': 'ten', '80': 'ten', '-80': 'signed_ten', '-8e-5 kg m^2': 'signed_ten', '8e-5': 'ten', '0.16': 'two', '0.04': 'two', '12.5': 'reciprocal', '0.5027': 'turn',
      '0.0803': 'close', '0.1': 'rounded',
    '0.08 kg m': 'unit', '0.08 m': 'unit', '0.08 g cm^2': 'scale', '0.0123': '', '0': '', '5000': '', '0.2': '',
  }
  for (const [text, expected] of Object.entries(cases)) assert.equal(say(text, INERTIA), `wrong ${expected}`.trim(), text)
})

test('degrees for radians, and radians for degrees', () => {
  const right = { answer: Math.PI / 6, tolerance: 0.001, unit: 'rad' }
  assert.equal(say('30', right), 'wrong degrees')
  for (const text of ['30 deg', '30°', 'pi/6', '0.5236', '0.5236 rad', '523.6 mrad', "1800'"]) assert.equal(say(text, right), 'right', text)
  const angle = { answer: 30, tolerance: 0.1, unit: 'deg' }
  assert.equal(say('0.5236', angle), 'wrong radians')
  for (const text of ['30', '30°', '0.5236 rad', 'pi/6 rad']) assert.equal(say(text, angle), 'right', text)
  const rate = { answer: 2 * Math.PI, tolerance: 0.01, unit: 'rad/s' }
  assert.equal(say('360', rate), 'wrong degrees')
  assert.equal(say('360 deg/s', rate), 'right')
  assert.equal(say('60 rpm', rate), 'right')
  assert.equal(say('1', rate), 'wrong turn')
  assert.equal(say('1 Hz', rate), 'wrong unit')
  assert.equal(say('6.2832 1/s', rate), 'right')
  // Where no angle is asked for, a factor of 57 is nothing known.
  assert.equal(say(String((0.08 * 180) / Math.PI), INERTIA), 'wrong')
})

test('a numeral that is the answer with fewer digits is rounded', () => {
  const exact = { answer: 1 / 3, tolerance: 1e-6, unit: '' }
  for (const text of ['0.3', '0.33', '0.333', '0,33']) assert.equal(say(text, exact), 'wrong rounded', text)
  assert.equal(say('0.66', { ...exact, answer: 2 / 3 }), 'wrong rounded') // cut off
  assert.equal(say('0.67', { ...exact, answer: 2 / 3 }), 'wrong rounded')
  assert.equal(say('330 m', { ...exact, unit: 'km' }), 'wrong') // 0.330, and not 0.333
  assert.equal(say('333 m', { ...exact, unit: 'km' }), 'wrong rounded')
  assert.equal(say('99', { answer: 100, tolerance: 0, unit: '' }), 'wrong')
  assert.equal(say('1/3.1', exact), 'wrong') // a calculation is not rounded
  assert.equal(say('1', { answer: 0.5, tolerance: 0.01, unit: '' }), 'wrong two') // far away
  assert.equal(say('1', { answer: 1.4, tolerance: 0.01, unit: '' }), 'wrong rounded')
})

test('a right number is never wrong for its writing alone', () => {
  const speed = { answer: 5, tolerance: 0.01, unit: 'm/s' }
  for (const text of ['5 ms⁻¹', '5ms-1', '5 m s^{-1}', '5 m.s⁻¹', '٥ m/s', '5 ㎧', '5000 mms⁻¹']) assert.equal(say(text, speed), 'right', text)
  assert.equal(say('5 ms⁻¹', { ...speed, answer: 5000, unit: '1/s' }), 'right') // of a millisecond
  assert.equal(say('5 ms', speed), 'wrong unit')
  assert.equal(say('5 mm', { ...speed, unit: 'm^2' }), 'wrong unit')
  assert.equal(say('2 kgms⁻²', { ...speed, answer: 2, unit: 'N' }), 'right')
  const angle = { answer: 30, tolerance: 0.01, unit: 'deg' }
  for (const text of ['30º', '30 ˚', '30°', '30 Grad', '30 grad', '30 grados', '30 degrés']) assert.equal(say(text, angle), 'right', text)
  const whole = { answer: 1200, tolerance: 1, unit: '' }
  assert.deepEqual(gradeNumber('1.200', whole), { state: 'unread', problem: 'either', detail: '1.200', readings: ['1200', '1.2000'] })
  for (const text of ['1.2000', '1.200+0', '1.20']) assert.equal(say(text, whole), 'wrong ten', text)
  assert.equal(say('1.200', { ...whole, answer: 70 }), 'wrong')
})

test('what cannot be read is no try', () => {
  const cases = { '1,200': 'either', '0.08 foo': 'unit', '2 3': 'numbers', kg: 'sign', '': 'empty', '1/0': 'finite', '0.08 kg + m': 'sign',
    '0.08 kg 3': 'unit', '1e300*1e300': 'finite' }
  for (const [text, problem] of Object.entries(cases)) assert.equal(say(text, INERTIA), `unread ${problem}`, text)
  assert.equal(say('5 kg', { answer: 5, tolerance: 0.1, unit: '' }), 'unread no_unit')
  assert.equal(say('50 %', { answer: 0.5, tolerance: 0.01, unit: '' }), 'right')
  assert.equal(say('0.5', { answer: 50, tolerance: 1, unit: '%' }), 'wrong ten')
})

test('units that nobody knows', () => {
  const asked = { answer: 5, tolerance: 0.1, unit: 'widgets/h' }
  for (const text of ['5', '5 widgets/h', '5 widgets / h']) assert.equal(say(text, asked), 'right', text)
  assert.equal(say('5 kg', asked), 'wrong unit')
  assert.equal(say('5 gadgets', asked), 'unread unit')
})

test('temperatures', () => {
  const asked = { answer: 293.15, tolerance: 0.1, unit: 'K' }
  assert.equal(say('20 °C', asked), 'right')
  assert.equal(say('20°C', asked), 'right')
  assert.equal(say('293.15 °C', asked), 'wrong scale')
  assert.equal(say('293.15', { answer: 20, tolerance: 0.1, unit: '°C' }), 'wrong')
  assert.equal(say('293.15 K', { answer: 20, tolerance: 0.1, unit: '°C' }), 'right')
})

test('an answer of 0 has an absolute tolerance and no near miss', () => {
  const asked = { answer: 0, tolerance: 0.001, unit: 'm' }
  for (const text of ['0', '-0', '0.0005', '0 m', '0.5 mm', '1-1', 'sin(pi)']) assert.equal(say(text, asked), 'right', text)
  for (const text of ['0.01', '1', '-1', '5 mm']) assert.equal(say(text, asked), 'wrong', text)
  assert.equal(say('0', { ...asked, tolerance: 0 }), 'right')
  assert.equal(say('1e-9', { ...asked, tolerance: 0 }), 'wrong')
})

test('what binary fractions cannot keep does not make a number wrong', () => {
  assert.equal(isWithin(0.1 + 0.2, 0.3, 0), true)
  assert.equal(isWithin(0.0801, 0.08, 0.0001), true)
  assert.equal(isWithin(0.08011, 0.08, 0.0001), false)
  assert.equal(say('0.1+0.2', { answer: 0.3, tolerance: 0, unit: '' }), 'right')
})

test('with a wide tolerance no slip is claimed', () => {
  assert.equal(nearMiss({ value: 2.2, step: null }, { answer: 1, tolerance: 0.5, angle: false }), '')
  assert.equal(nearMiss({ value: -1, step: null }, { answer: 1, tolerance: 0.1, angle: false }), 'sign')
})

test('a slip is found whatever the number, and what is right is never called one', () => {
  let seed = 1
  const random = () => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff
    return seed / 0x7fffffff
  }
  const slips = { sign: (x) => -x, ten: (x) => x * 1e3, signed_ten: (x) => -x * 1e3, two: (x) => x / 2, reciprocal: (x) => 1 / x, turn: (x) => x * 2 * Math.PI }
  for (let i = 0; i < 1000; i++) {
    const answer = (random() + 0.1) * 10 ** Math.floor(random() * 12 - 6) * (random() < 0.5 ? -1 : 1)
    const asked = { answer, tolerance: 0.001 * Math.abs(answer), unit: '' }
    assert.equal(say(String(answer * (1 + (random() - 0.5) * 0.0019)), asked), 'right')
    for (const [name, slip] of Object.entries(slips)) {
      const { state, slip: near } = gradeNumber(`${slip(answer)}+0`, asked)
      // Two slips can give the same number; then one of them is named.
      const alike = (other) => other !== slip && isWithin(other(answer), slip(answer), Math.abs(slip(answer)) * 0.002)
      const again = state === 'right' || Object.values(slips).some(alike)
      assert.ok(near === name || again || near === 'ten' || near === 'signed_ten' || near === 'close', `${answer}: ${slip(answer)} is ${near}, not ${name}`)
    }
  }
})

test('no message gives the answer away', () => {
  // Which slip it is depends on the answer; the sentence does not: it has no value to fill in.
  const words = readFileSync(new URL('../../templates/strings/en.toml', import.meta.url), 'utf8')
  const near = words.split('[quiz.live.near]')[1].split('\n[')[0]
  assert.ok(!near.includes('{'))
  const named = [...near.matchAll(/^(\w+) = /gm)].map(([, name]) => name)
  const source = readFileSync(new URL('../js/quiz/grade.js', import.meta.url), 'utf8')
  for (const name of named) assert.ok(source.includes(`'${name}'`), name)
})

test('every problem and every slip has its words', () => {
  const words = readFileSync(new URL('../../templates/strings/en.toml', import.meta.url), 'utf8')
  const table = (name) => words.split(`[quiz.live.${name}]`)[1].split('\n[')[0]
  for (const problem of ['empty', 'long', 'end', 'sign', 'numeral', 'numbers', 'either', 'product', 'parenthesis', 'argument', 'log',
    'finite', 'unit', 'no_unit'])
    assert.match(table('unread'), new RegExp(`^${problem} = `, 'm'))
  for (const near of ['rounded', 'close', 'sign', 'degrees', 'radians', 'ten', 'signed_ten', 'two', 'turn', 'reciprocal', 'unit',
    'scale']) assert.match(table('near'), new RegExp(`^${near} = `, 'm'))
  for (const near of ['case', 'space', 'digits', 'numbers']) assert.match(table('printed'), new RegExp(`^${near} = `, 'm'))
})

// --- output

const printed = (text, line, rule = 'digits') => {
  const { right, slip: near } = gradeOutput(text, line, compareBy(rule))
  return right ? 'right' : near || 'wrong'
}

test('white space is folded, everything else is text', () => {
  assert.equal(printed('a b', 'a   b'), 'right')
  assert.equal(printed('  a b ', 'a b'), 'right')
  assert.equal(printed('[1,2]', '[1, 2]'), 'right')
  assert.equal(printed("('a', 1)", "( 'a',1 )"), 'right')
  assert.equal(printed('“a”', '"a"'), 'right')
  assert.equal(printed('ab', 'a b'), 'space')
  assert.equal(printed('a b', 'ab'), 'space')
  assert.equal(printed('True', 'true'), 'case')
  assert.equal(printed('true', 'false'), 'wrong')
  assert.equal(printed('a', 'a a'), 'wrong')
  assert.equal(printed('', 'a'), 'wrong')
  assert.equal(printed('Größe', 'Gro\u0308ße'.normalize('NFC')), 'right')
})

test('numbers are compared as the recording is', () => {
  assert.equal(printed('T = 2.0061 s', 'T = 2.0061 s'), 'right')
  assert.equal(printed('T=2.0061 s', 'T = 2.0061 s'), 'right')
  assert.equal(printed('T = 2.00614 s', 'T = 2.0061 s'), 'right')
  assert.equal(printed('T = 2.006 s', 'T = 2.0061 s'), 'digits')
  assert.equal(printed('T = 2.1 s', 'T = 2.0061 s'), 'numbers')
  assert.equal(printed('t = 2.0061 s', 'T = 2.0061 s'), 'case')
  assert.equal(printed('0.080', '0.08'), 'right')
  assert.equal(printed('8e-2', '0.08'), 'right')
  assert.equal(printed('−1.5', '-1.5'), 'right')
  for (const text of ['−1,5', '‒١٫٥', '-\u20091.5']) assert.equal(printed(text, '-1.5'), text.includes('\u2009') ? 'space' : 'right', text)
  assert.equal(printed('(1,5)', '(1, 5)'), 'right')
  assert.equal(printed('(1,5)', '(1, 6)'), 'numbers')
  assert.equal(printed('1.5', '-1.5'), 'wrong')
  assert.equal(printed('3', '3'), 'right')
  assert.equal(printed('3.0', '3'), 'right') // the same value
  assert.equal(printed('4', '3'), 'wrong')
  assert.equal(printed('1.0001', '1.0', 'exact'), 'wrong')
  assert.equal(printed('1.00', '1.0', 'exact'), 'right')
  assert.equal(printed('1.001', '1.0', 'rtol=0.01 atol=0.0'), 'right')
  assert.equal(printed('1.1', '1.0', 'rtol=0.01 atol=0.0'), 'wrong')
  assert.equal(printed('0.0001', '0.0', 'rtol=0.0 atol=0.001'), 'right')
  assert.equal(printed('1e-06', '1e-6', 'rtol=1e-06 atol=1e-12'), 'right')
  assert.equal(printed('nan', 'nan'), 'right')
  assert.equal(printed('x1', 'x1'), 'right')
  assert.equal(printed('x2', 'x1'), 'wrong') // no number, but a name
  assert.equal(printed('a-1', 'a -1'), 'space') // a difference, and a number below zero
})

test('the last place of a printed number', () => {
  for (const [text, place] of [['2.0061', 1e-4], ['12', 1], ['1e-6', 1e-6], ['1.50e3', 10], ['-.5', 0.1],
    ['3.', 1]]) assert.ok(Math.abs(lastPlace(text) / place - 1) < 1e-12, text)
})

test('any text is right for itself', () => {
  let seed = 4
  const random = (n) => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff
    return (seed >> 8) % n
  }
  const pieces = [...'01.-+e[](),:= \t"\'ab', 'é', '💥', '\u0000', '1.5', '-2', 'nan', '1e-06', '\ud800']
  for (let i = 0; i < 1000; i++) {
    const text = Array.from({ length: random(14) }, () => pieces[random(pieces.length)]).join('')
    for (const rule of ['exact', 'digits', 'rtol=1e-06 atol=0.0',
      '']) assert.equal(printed(text, text, rule), 'right', JSON.stringify(text))
    assert.equal(printed(` ${text.replaceAll(' ', '   ')} `, text, 'exact'), 'right', JSON.stringify(text))
  }
})

// --- order

test('orders', () => {
  assert.deepEqual(gradeOrder(['a', 'b', 'c'], ['a', 'b', 'c']), { right: true, placedCount: 3 })
  assert.deepEqual(gradeOrder(['b', 'a', 'c'], ['a', 'b', 'c']), { right: false, placedCount: 1 })
  assert.deepEqual(gradeOrder(['a', 'b'], ['a', 'b', 'c']), { right: false, placedCount: 2 })
  assert.deepEqual(gradeOrder(['a', 'b', 'c', 'd'], ['a', 'b', 'c']), { right: false, placedCount: 3 })
  assert.deepEqual(moveBy(['a', 'b', 'c'], 'c', -1), ['a', 'c', 'b'])
  assert.deepEqual(moveBy(['a', 'b', 'c'], 'c', 1), ['a', 'b', 'c'])
  assert.deepEqual(moveBy(['a', 'b', 'c'], 'a', -5), ['a', 'b', 'c'])
  assert.deepEqual(moveBy(['a', 'b', 'c'], 'a', 5), ['b', 'c', 'a'])
  assert.deepEqual(moveTo(['a', 'b', 'c'], 'b', 0), ['b', 'a', 'c'])
  assert.equal(placeAt(15, [10, 20, 30]), 1)
  assert.equal(placeAt(5, [10, 20]), 0)
  assert.equal(placeAt(50, [10, 20]), 2)
})

test('a kept order fits the items that there are now', () => {
  assert.deepEqual(restoreOrder(['b', 'a'], ['a', 'b', 'c']), ['b', 'a', 'c'])
  assert.deepEqual(restoreOrder(['x', 'b', 'b'], ['a', 'b']), ['b', 'a'])
  for (const kept of [null, undefined, 'ab', 5, {}, [{}], [null]]) assert.deepEqual(restoreOrder(kept, ['a', 'b']), ['a', 'b'])
})

test('moves never lose or double an item', () => {
  let seed = 2
  const random = (n) => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff
    return (seed >> 8) % n
  }
  let order = ['a', 'b', 'c', 'd', 'e']
  for (let i = 0; i < 2000; i++) {
    const key = 'abcde'[random(5)]
    order = random(2) ? moveBy(order, key, random(9) - 4) : moveTo(order, key, random(9) - 2)
    assert.equal([...order].sort().join(''), 'abcde')
  }
})
