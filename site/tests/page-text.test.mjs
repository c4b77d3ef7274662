/** Numbers, texts, links and scripts that the page writes. */

import './new-in-node.mjs'
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { deflateRawSync } from 'node:zlib'
import { readError } from '../js/lab/page/editor.js'
import { fillScript } from '../js/lab/page/export.js'
import { placeOf } from '../js/lab/page/shell.js'
import {
  digitsOfStep,
  formatLabel,
  formatNumber,
  formatReadout,
  formatRough,
  formatTime,
  superscript,
  withUnit,
} from '../js/lab/page/numbers.js'
import { LONGEST, readLink, writeLink } from '../js/lab/page/share.js'
import { spread } from '../js/lab/page/span.js'
import { fill } from '../js/page/words.js'

test('numbers keep their width when the sign changes, and zero has none', () => {
  assert.equal(formatNumber(-6, 3), '−6.000')
  assert.equal(formatNumber(6, 3), '\u20076.000')
  assert.equal(formatNumber(-0.0001, 3), '\u20070.000')
  assert.equal(formatNumber(-0, 2), '\u20070.00')
  assert.equal(formatNumber(0.0624, 5).length, formatNumber(-0.0624, 5).length)
})

test('numbers without digits have six significant figures; very large and small ones a power of ten', () => {
  assert.equal(formatNumber(Math.PI, null).trim(), '3.14159')
  assert.equal(formatNumber(0, null).trim(), '0')
  assert.equal(formatNumber(1.5e12, null).trim(), '1.5000·10¹²')
  assert.equal(formatNumber(-2.5e-9, null), '−2.5000·10⁻⁹')
  assert.equal(formatNumber(3e12, 3).trim(), '3.000·10¹²')
})

test('what is no number is said', () => {
  assert.equal(formatNumber(NaN, 3), 'NaN')
  assert.equal(formatNumber(Infinity, 3), '∞')
  assert.equal(formatNumber(-Infinity, 3), '−∞')
  assert.equal(formatReadout('stuck', 3), 'stuck')
  for (const nothing of [undefined, null, NaN]) assert.equal(formatReadout(nothing, 3), '–')
})

test('labels, times, ratios', () => {
  assert.equal(formatLabel(-0.30000000000000004), '−0.3')
  assert.equal(formatLabel(0), '0')
  assert.equal(formatLabel(2.5e8), '2.5·10⁸')
  assert.equal(formatLabel(-1e-9), '−10⁻⁹')
  assert.equal(formatTime(3.14159), '3.14')
  assert.equal(formatTime(-1), '−1.00')
  assert.equal(formatRough(0.412), '0.4')
  assert.equal(formatRough(0.0312), '0.03')
  assert.equal(superscript(-12), '⁻¹²')
})

test('numbers have the decimal sign of the page', async () => {
  globalThis.document = { documentElement: { dataset: { decimal: ',' } } }
  const page = await import('../js/lab/page/numbers.js?comma')
  delete globalThis.document
  assert.equal(page.formatNumber(-1.5, 2), '−1,50')
  assert.equal(page.formatReadout('a 1.5', 2), 'a 1.5')
  assert.equal(page.formatLabel(-2.5e-9), '−2,5·10⁻⁹')
  assert.equal(page.formatTime(0.5), '0,50')
  assert.equal(page.formatRough(0.412), '0,4')
})

test('a slider shows as many digits as its steps need', () => {
  for (const [step, digits] of [
    [1, 0],
    [0.5, 1],
    [0.25, 2],
    [0.1, 1],
    [0.3, 1],
    [0.001, 3],
    [10, 0],
    [null, 2],
    [1 / 3, 6],
  ]) {
    assert.equal(digitsOfStep(step), digits, String(step))
  }
})

test('a unit stands apart from its number, and a degree does not', () => {
  const texts = [withUnit('5', 'kg'), withUnit('5', '°'), withUnit('5', '°C'), withUnit('5', '')]
  assert.deepEqual(texts, ['5\u00a0kg', '5°', '5\u00a0°C', '5'])
})

test('a script takes the values of the controls, and dollars stay dollars', () => {
  assert.equal(
    fillScript('m = {{control:1}}  # $& {{control}}\nn = {{control:0}}', [3, "it's $1"]),
    'm = "it\'s $1"  # $& {{control}}\nn = 3',
  )
})

test('texts take values by name', () => {
  assert.equal(fill('at {t} s, {x}: {t}', { t: '1.20' }), 'at 1.20 s, {x}: 1.20')
})

test('in texts from the right, numbers keep their signs and units before and behind them', () => {
  assert.equal(fill('عند {t}، {n} صفحات', { t: '−0.20 s', n: 3 }), 'عند \u2066−0.20 s\u2069، 3 صفحات')
  assert.equal(fill('عند t = {t} s', { t: '1.20' }), 'عند t = 1.20 s')
  assert.equal(fill('{a}: {b}', { a: 'MuJoCo 3.14.0', b: '1.1 البندول' }), 'MuJoCo 3.14.0: 1.1 البندول')
  assert.equal(fill('تابع مع {title}', { title: '1.1 A pendulum' }), 'تابع مع 1.1 A pendulum')
  assert.equal(fill('تابع مع {title}', { title: '1.1 Model and data' }), 'تابع مع 1.1 Model and data')
})

test('a state comes back from a link bit for bit, whatever its values', async () => {
  const physics = new Float64Array([0, -0, NaN, 1 / 3, -1e-310, Infinity])
  new DataView(physics.buffer).setBigUint64(16, 0x7ff0_0000_0a0a_0001n, true) // a NaN of another kind, with line ends in it
  const state = { values: [null, 0.1, 'ä?&#\n', true], steps: 1234, time: 2.468, physics }
  const { link, only } = await writeLink('4.2-lab-1', state)
  assert.match(link, /^#lab=4\.2-lab-1&z=[\w-]+$/)
  assert.equal(only, null)
  const { id, state: back } = await readLink(link)
  assert.equal(id, '4.2-lab-1')
  assert.deepEqual([back.values, back.steps, back.time], [state.values, 1234, 2.468])
  assert.deepEqual(new Uint8Array(back.physics.buffer), new Uint8Array(physics.buffer))
})

test('a state of a thousand numbers has room in a link, one of ten thousand keeps its controls', async () => {
  const numbers = (length) => Float64Array.from({ length }, (_, i) => Math.sin(1 + i))
  for (const [length, fits] of [[1200, true], [10_000, false]]) {
    const physics = numbers(length)
    const { link, only } = await writeLink('a', { values: [1], steps: 5, time: 1, physics })
    assert.equal(only, fits ? null : 'controls', String(length))
    assert.ok(link.length < LONGEST + 20)
    assert.deepEqual((await readLink(link)).state, { values: [1], steps: 5, time: 1, physics: fits ? physics : null })
  }
  const resting = await writeLink('a', { values: [], steps: 0, time: 0, physics: new Float64Array(100_000) })
  assert.ok(resting.only === null && resting.link.length < 2000, 'zeros take no room')
})

test('links that are not of a lab, or broken, give no state', async () => {
  assert.equal(await readLink(''), null)
  assert.equal(await readLink('#section-2'), null)
  const deflated = ['{}', 'null', '{"v":3}', '{"v":[]}\nseven b'].map((text) => deflateRawSync(text).toString('base64url'))
  for (const text of ['%', 'AAAA', 'é', ...deflated]) {
    assert.deepEqual(await readLink(`#lab=x&z=${text}`), { id: 'x', state: null }, text)
  }
  assert.deepEqual(await readLink('#lab=x'), { id: 'x', state: null })
})

test('a link that unfolds to very much gives no state', async () => {
  const bytes = deflateRawSync(Buffer.concat([Buffer.from('{"v":[]}\n'), Buffer.alloc(16 << 20)]))
  assert.deepEqual(await readLink(`#lab=x&z=${bytes.toString('base64url')}`), { id: 'x', state: null })
})

test('a model that the reader wrote goes into a link, if it is not too long for one', async () => {
  const state = { values: [], steps: 0, time: 0, physics: new Float64Array() }
  const text = '<mujoco model="Ärm 😀">\n\t<worldbody/>\n</mujoco>'
  const { link, only } = await writeLink('a', { ...state, text })
  assert.equal(only, null)
  assert.equal((await readLink(link)).state.text, text)
  const long = await writeLink('a', { ...state, text: '<geom size="1"/>\n'.repeat(6000) })
  assert.equal((await readLink(long.link)).state.text, undefined, 'unfolds to more than a page takes')
  const noise = Array.from({ length: 20_000 }, (_, i) => Math.sin(i).toString(36)).join('')
  assert.equal((await writeLink('a', { ...state, text: noise })).only, 'controls')
})

test('what MuJoCo says of a model is told with its line, in its words', () => {
  for (const [message, line, text] of [
    ["XML Error: Schema violation: unrecognized attribute: 'foo'\nElement 'geom', line 3\n\n", 3, "Schema violation: unrecognized attribute: 'foo'\nElement 'geom', line 3"],
    ["Error: unknown transmission target 'q' for actuator id = 0\nElement name '', id 0, line 6\n", 6, "unknown transmission target 'q' for actuator id = 0\nElement name '', id 0, line 6"],
    ['XML parse error 14:\nError=XML_ERROR_MISMATCHED_ELEMENT ErrorID=14 (0xe) Line number=3: XMLElement name=geom\n\n', 3, "XML: mismatched element\nElement 'geom'"],
    ['XML parse error 8:\nError=XML_ERROR_PARSING_TEXT ErrorID=8 (0x8) Line number=1\n\n', 1, 'XML: parsing text'],
    ["Error: Error opening file 'line 7.stl'\n", 0, "Error opening file 'line 7.stl'"],
  ]) assert.deepEqual(readError(message), { line, text })
})

test('an entry is named as its author finds it', () => {
  const config = { controls: [{}, { label: 'push' }], plots: [{ traces: [{ label: 'ω' }] }] }
  assert.equal(placeOf(['controls', 1, 'run'], config), 'controls[1].run (“push”)')
  assert.equal(placeOf(['plots', 0, 'traces', 0, 'expr'], config), 'plots[0].traces[0].expr (“ω”)')
  assert.equal(placeOf(['setup'], config), 'setup')
})

test('labels that would lie on each other move apart, as little as can be', () => {
  assert.deepEqual(spread([10, 50, null], 12, 0, 100), [10, 50, null])
  assert.deepEqual(spread([50, 50], 10, 0, 100), [45, 55])
  assert.deepEqual(spread([99, 98, 97], 10, 0, 100), [100, 90, 80])
  assert.deepEqual(spread([0, 1], 10, 0, 100), [0, 10])
  // A group that grows into the next takes it in.
  assert.deepEqual(spread([40, 42, 55], 10, 0, 100), [35.666666666666664, 45.666666666666664, 55.666666666666664])
})
