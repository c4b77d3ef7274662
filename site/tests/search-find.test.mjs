import assert from 'node:assert/strict'
import test from 'node:test'
import { matchActions, pagesByNumber } from '../js/search/actions.js'
import { findPages } from '../js/search/pages.js'
import { forgetQueries, noteQuery, recentQueries } from '../js/search/recent.js'
import { excerpt, findSections, markWords, phraseFactor, trail } from '../js/search/sections.js'
import { indexed } from './search-helpers.mjs'

const COURSE = [
  {
    name: '4.2',
    title: 'Mass and inertia',
    sections: [
      ['', '', 0, [['t', 'What plays the part of mass.']], ''],
      ['tensor', 'The inertia tensor', 2, [['t', 'For a body, the moments are I_xx, I_yy. It is symmetric.']], ''],
      ['euler', "Euler's equations", 3, [['f', 'τ = I dω/dt + ω × I ω']], 'dot times'],
      ['run', 'Implementation', 2, [['c', 'import mujoco\nmujoco.mj_forward(model, data)\nprint(data.qpos[3])']], ''],
    ],
  },
  {
    name: '4.3',
    title: 'Free rotation',
    sections: [['drift', 'Drift of the energy', 2, [['t', 'Of an Euler step the drift of the energy is of first order; see lesson 4.2.']], '']],
  },
  { name: '4.4', title: 'Contact', sections: [['a', 'Tensor', 2, [['t', 'A tensor; later, in other words, an inertia.']], '']] },
  { kind: 'page', title: 'Writing lessons', sections: [['i', 'Inertia tensor', 2, [['t', 'How the inertia tensor is written.']], '']] },
  { kind: 'lesson', name: '5.1', title: '慣性力', sections: [['', '', 0, [['t', '遠心力は慣性力である。']], '']] },
]
const { source, asked, opened } = indexed(COURSE)
const titles = async (query) => (await findPages(query, source)).pages.map(({ page }) => COURSE[page].title)
const first = async (query) => (await titles(query))[0]

test('words in headings of lessons come before the same in other pages', async () => {
  assert.deepEqual((await titles('inertia tensor')).slice(0, 2), ['Mass and inertia', 'Writing lessons'])
})

test('a planned lesson comes last, however well it fits', async () => {
  const planned = { kind: 'stub', name: '4.5', title: 'Inertia tensor', sections: [['', '', 0, [['t', 'The inertia tensor.']], '']] }
  const { source } = indexed([...COURSE, planned])
  const { pages } = await findPages('inertia tensor', source)
  assert.deepEqual(pages.map(({ page }) => page), [0, 3, 2, 5])
})

test('a page is found by its number before those that mention it', async () => {
  assert.deepEqual(await titles('4.2'), ['Mass and inertia', 'Free rotation'])
  assert.equal(await first('lesson 4.2'), 'Mass and inertia')
})

test('a formula is found by its signs, their names, and their TeX', async () => {
  for (const query of ['Iₓₓ', 'I_xx', 'I_{xx}', 'ixx', 'ω', 'omega', '\\omega', '\\dot{\\omega}', 'τ = I ω', '\\mathbf{\\tau}']) {
    assert.equal(await first(query), 'Mass and inertia', query)
  }
})

test('code is found by names, their parts and their beginnings', async () => {
  for (const query of ['mj_forward', 'mjforward', 'forward', 'mujoco.mj_forward', 'data.qpos', 'qpos', 'mj_for', 'MJ_Forward', 'data.qp', 'mujoco.mj_forwrad', 'numpy.mj_forward']) {
    assert.equal(await first(query), 'Mass and inertia', query)
  }
  assert.deepEqual(await titles('mj_backward'), [])
  assert.equal(await first('data.qpos mj_forward'), 'Mass and inertia')
})

test('misspelt words are set right, and it is said', async () => {
  const { pages, words } = await findPages('euler drfit', source)
  assert.equal(COURSE[pages[0].page].title, 'Free rotation')
  assert.deepEqual(words.map(({ instead }) => instead), [null, 'drift'])
  for (const query of ['inretia', 'nertia', 'inertiaa', 'mj_forwrad', 'tensro']) assert.notEqual((await titles(query)).length, 0, query)
  assert.deepEqual(await titles('qzxwv'), [])
})

test('a word that may be two others is taken for the one of more pages', async () => {
  const texts = ['A fraction.', 'Some friction.', 'More friction.']
  const pages = texts.map((text) => ({ title: 'On', sections: [['', '', 0, [['t', text]], '']] }))
  const { words } = await findPages('frction', indexed(pages).source)
  assert.deepEqual(words.map(({ instead }) => instead), ['friction'])
})

test('a beginning of a word finds it, a short one in titles only', async () => {
  assert.equal(await first('equa'), 'Mass and inertia')
  assert.deepEqual(await titles('equ'), [])
  assert.deepEqual(await titles('ro'), ['Free rotation'])
  const { source } = indexed([...COURSE, { kind: 'page', title: 'MuJoCo', sections: [['', '', 0, [['t', 'The muscle μ of MuJoCo.']], '']] },
    { name: '9.3', title: 'Cones', sections: [['', '', 0, [['t', 'Its slope is μ.']], '']] }])
  const { pages } = await findPages('μ', source)
  assert.deepEqual(pages.map(({ page }) => page), [6, 5], 'a word as it is comes before a title that begins so')
})

test('characters without spaces are found inside', async () => {
  assert.deepEqual(await titles('慣性'), ['慣性力'])
  assert.deepEqual(await titles('心力'), ['慣性力'])
  assert.deepEqual(await titles('遠'), ['慣性力'])
  assert.deepEqual(await titles('重力'), [])
})

test('a query loads the files of its words and no others', async () => {
  asked.length = 0
  await titles('inertia')
  assert.equal(asked.length, 1)
})

test('no query is too odd', async () => {
  for (const query of ['', '   ', '!!!', '(', '\\', '\\frac{', 'a'.repeat(200), '. . .', '"x', '🙂', '_', '__proto__', 'constructor', 'x '.repeat(90)]) {
    assert.ok(Array.isArray(await titles(query)), query)
  }
})

test('sections with all words come first, and say where they stand', async () => {
  const { words } = await findPages('inertia tensor', source)
  const found = findSections(opened[0], words)
  assert.equal(found[0].at, 1)
  assert.deepEqual(trail(opened[0].sections, 2), ['The inertia tensor', "Euler's equations"])
  assert.deepEqual(trail(opened[0].sections, 0), [])
})

test('words that follow each other count more, in a heading most', async () => {
  const { words } = await findPages('inertia tensor', source)
  assert.ok(phraseFactor(opened[0], COURSE[0].title, words) > phraseFactor(opened[2], COURSE[2].title, words))
  assert.equal(phraseFactor(opened[2], COURSE[2].title, words), 1)
})

test('an excerpt shows the line of code, or the words around, marked', async () => {
  const { words } = await findPages('mj_forward', source)
  assert.deepEqual(excerpt(opened[0].sections[3], words), {
    code: true,
    parts: [
      { text: 'mujoco.', isMarked: false },
      { text: 'mj_forward', isMarked: true },
      { text: '(model, data)', isMarked: false },
    ],
  })
  const name = await findPages('data.qpos', source)
  assert.deepEqual(markWords('print(data.qpos[3])', name.words)[1], { text: 'data.qpos', isMarked: true })
  const long = ['', '', 0, [['t', `${'so '.repeat(60)}the energy of it ${'and on '.repeat(60)}`]], '']
  const { parts } = excerpt(long, (await findPages('energy', source)).words)
  assert.equal(parts[0].text, '… ')
  assert.equal(parts.at(-1).text, ' …')
  assert.deepEqual(parts.filter((part) => part.isMarked), [{ text: 'energy', isMarked: true }])
  assert.ok(parts.map(({ text }) => text).join('').length < 200)
})

test('marks keep the text whole', async () => {
  const { words } = await findPages('慣性力 <b>', source)
  for (const text of ['遠心力は慣性力である。', '<b>𝛚</b> & 慣性', '']) {
    assert.equal(
      markWords(text, words)
        .map((part) => part.text)
        .join(''),
      text,
    )
  }
})

test('actions are found by the beginnings of their words, lessons by number', () => {
  const actions = [{ title: 'Print this page' }, { title: 'Colours: Dark' }, { title: 'Course map' }]
  assert.deepEqual(matchActions(actions, 'pri pa'), [actions[0]])
  assert.deepEqual(matchActions(actions, 'dark'), [actions[1]])
  assert.equal(matchActions(actions, '').length, 3)
  assert.deepEqual(pagesByNumber(source.listing, '4.', 9).map(([, , , name]) => name), ['4.2', '4.3', '4.4'])
  assert.deepEqual(pagesByNumber(source.listing, '4.3', 9).map(([, , , name]) => name), ['4.3'])
  assert.deepEqual(pagesByNumber(source.listing, 'four', 9), [])
})

test('queries are remembered, and damaged or closed storage is nothing', () => {
  const kept = new Map()
  const storage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value), removeItem: (key) => kept.delete(key) }
  for (const query of ['a', 'b', ' a ', 'c', 'd', 'e', 'f', '']) noteQuery('x', query, storage)
  assert.deepEqual(recentQueries('x', storage), ['f', 'e', 'd', 'c', 'a'])
  assert.deepEqual(recentQueries('y', storage), [])
  for (const damage of ['{', '{}', '[1, null, "z"]', 'null']) {
    kept.set('coursebuild.search.x', damage)
    assert.deepEqual(recentQueries('x', storage), damage.includes('z') ? ['z'] : [])
  }
  forgetQueries('x', storage)
  assert.equal(kept.size, 0)
  const closed = { getItem: () => assert.fail(), setItem: () => { throw new Error('full') }, removeItem: () => { throw new Error('closed') } }
  forgetQueries('x', closed)
  noteQuery('x', 'q', { getItem: () => null, ...closed, getItem: () => null })
  assert.deepEqual(recentQueries('x', null), [])
})
