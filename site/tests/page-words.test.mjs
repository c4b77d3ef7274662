import assert from 'node:assert/strict'
import test from 'node:test'

import { form } from '../js/page/words.js'

const words = (table) => (key) => table[key] ?? key
const SIX = words(Object.fromEntries(['zero', 'one', 'two', 'few', 'many', 'other'].map((name) => [`a.${name}`, name])))

test('a number chooses the form that its language has for it', () => {
  const forms = (language, numbers) => numbers.map((n) => form(SIX, 'a', n, language))
  assert.deepEqual(forms('ar', [0, 1, 2, 3, 11, 100, 103]), ['zero', 'one', 'two', 'few', 'many', 'other', 'few'])
  assert.deepEqual(forms('en', [0, 1, 2]), ['other', 'one', 'other'])
  assert.deepEqual(forms('fr-CA', [0, 1, 2]), ['one', 'one', 'other'])
})

test('a form that a page lacks is the general one', () => {
  assert.equal(form(words({ 'a.one': 'one', 'a.other': 'other' }), 'a', 2, 'ar'), 'other')
  assert.equal(form(SIX, 'a', 2, 'not a language'), 'other')
  assert.equal(form(SIX, 'a', 1, undefined), 'one')
})
