import assert from 'node:assert/strict'
import { test } from 'node:test'
import { grade, interaction } from '../js/scorm/answers.js'
import { findApi } from '../js/scorm/find.js'
import { questionsOf } from '../js/scorm/frame.js'
import { clock, decimal, identifier, shortText, signOf, timespan } from '../js/scorm/formats.js'
import { beginSession } from '../js/scorm/session.js'
import { pack, unpack } from '../js/scorm/suspend.js'
import { Visit } from '../js/scorm/visit.js'
import { openProgress } from '../js/progress/store.js'
import { StrictApi } from './scorm-api.mjs'

// --- formats

test('times are written as the data model wants them, whatever they are', () => {
  assert.equal(timespan(0), '0000:00:00.00')
  assert.equal(timespan(61_239), '0000:01:01.23')
  assert.equal(timespan(3_600_000 * 27 + 59_999), '0027:00:59.99')
  assert.equal(timespan(-5), '0000:00:00.00')
  assert.equal(timespan(1e15), '9999:59:59.99')
  assert.equal(clock(new Date(2026, 0, 1, 7, 5, 9)), '07:05:09')
})

test('numbers are decimals without an exponent, or none', () => {
  for (const [text, number] of [['0.08', '0.08'], ['0,08', '0.08'], ['+3', '3'], ['\u22121.5', '-1.5'], ['.5', '0.5'], ['-.5', '-0.5'], ['7.', '7']]) {
    assert.equal(decimal(text), number)
  }
  for (const text of ['1e-3', '', 'x', '1 kg', '1.2.3', 'NaN', 'Infinity', '.', '1'.repeat(40)]) assert.equal(decimal(text), null)
})

test('texts are cut to 255 characters and have no line ends', () => {
  assert.equal(shortText(' a\n\tb\u2028c '), 'a b c')
  assert.equal(shortText('x'.repeat(300)).length, 255)
  assert.equal(shortText('x'.repeat(254) + '😀').length, 254)
})

test('identifiers are printable ASCII, and others for other texts', () => {
  assert.equal(identifier('4.2-check.ab12'), '4.2-check.ab12')
  assert.match(identifier('Trägheit und Δx'), /^[!-~]+$/)
  assert.notEqual(identifier('ä'), identifier('ö'))
  assert.equal(signOf(0) + signOf(25) + signOf(26) + signOf(35), 'az09')
  assert.equal(signOf(36), null)
})

// --- answers

const mcq = { quiz: 'q', key: 'k1', kind: 'mcq', parts: ['red', 'green', 'blue'], answer: 'green' }
const several = { ...mcq, kind: 'several', key: 'k2', answer: 'red blue' }
const number = { quiz: 'q', key: 'k3', kind: 'numeric', parts: [], answer: '0.08' }
const order = { quiz: 'q', key: 'k4', kind: 'order', parts: ['c', 'a', 'b'], answer: 'a b c' }
const output = { quiz: 'q', key: 'k5', kind: 'output', parts: [], answer: 'drift +6.6 %' }
const open = { quiz: 'q', key: 'k6', kind: 'open', parts: [], answer: null }
const noon = new Date(2026, 5, 1, 12, 0, 0)
const told = (question, given, right) => Object.fromEntries(interaction(question, { given, right }, noon))

test('each kind of question has its type and its way to write responses', () => {
  assert.deepEqual(told(mcq, ['blue'], false), {
    id: 'q.k1', type: 'choice', time: '12:00:00', 'correct_responses.0.pattern': 'b', student_response: 'c', weighting: '1', result: 'wrong',
  })
  assert.equal(told(several, ['blue', 'red'], true).student_response, 'a,c')
  assert.equal(told(several, ['blue', 'red'], true)['correct_responses.0.pattern'], 'a,c')
  const ordered = told(order, ['a', 'b', 'c'], true)
  assert.deepEqual([ordered.type, ordered.student_response, ordered['correct_responses.0.pattern']], ['sequencing', 'b,c,a', 'b,c,a'])
  const counted = told(number, '0,08', true)
  assert.deepEqual([counted.type, counted.student_response, counted['correct_responses.0.pattern']], ['numeric', '0.08', '0.08'])
  const said = told(number, '8e-2 kg m^2', true)
  assert.deepEqual([said.type, said.student_response], ['fill-in', '8e-2 kg m^2'])
  assert.equal(told(output, 'drift +6.6 %', true)['correct_responses.0.pattern'], 'drift +6.6 %')
})

test('what a learner thinks of an own text is no verdict', () => {
  const words = told(open, { text: 'Because\nit turns.', mark: 'good' }, true)
  assert.deepEqual([words.type, words.result, words.student_response], ['fill-in', 'neutral', 'Because it turns.'])
  assert.equal(words['correct_responses.0.pattern'], undefined)
})

test('an option that is no longer there, and more options than there are signs, are said in words', () => {
  assert.equal(told(mcq, ['gone'], false).type, 'fill-in')
  const many = { ...mcq, parts: Array.from({ length: 40 }, (_, n) => `o${n}`), answer: 'o39' }
  assert.deepEqual([told(many, ['o39'], true).type, told(many, ['o39'], true).student_response], ['fill-in', 'o39'])
})

test('points and status follow from the questions that can be checked', () => {
  const answers = new Map()
  const of = ({ key }) => answers.get(key) ?? null
  const questions = [mcq, number, output, open]
  assert.deepEqual(grade(questions, of, true), { raw: 0, status: 'incomplete' })
  answers.set('k1', { right: true }).set('k3', { right: false })
  assert.deepEqual(grade(questions, of, false), { raw: 33.33, status: 'incomplete' })
  answers.set('k5', { right: true })
  assert.deepEqual(grade(questions, of, false), { raw: 66.66, status: 'completed' })
  answers.set('k3', { right: true })
  assert.deepEqual(grade(questions, of, false), { raw: 100, status: 'passed' })
  assert.deepEqual(grade([open], of, false), { raw: null, status: 'incomplete' })
  assert.deepEqual(grade([], of, true), { raw: null, status: 'completed' })
})

// --- what is kept

const kept = (n, given = ['a'], right = true) => ({
  quiz: `quiz-${n % 7}`, key: `key${n}`, kind: 'mcq', given, right, tries: n % 4, hints: 1, number: n, at: new Date(1e12 + n * 1000).toISOString(),
})

test('what is kept comes back', () => {
  const answers = [kept(1), kept(2, 'text', false), kept(3, { text: 'é "\\', mark: 'half' }, null)]
  const back = unpack(pack(answers, true))
  const sorted = (all) => [...all].sort((a, b) => (a.key < b.key ? -1 : 1))
  assert.deepEqual(sorted(back.answers), sorted(answers))
  assert.equal(back.read, true)
})

test('an exercise that is solved counts, is recorded, and comes back', () => {
  const document = { querySelectorAll: (selector) => (selector === '[data-exercise]' ? [{ dataset: { exercise: '{"id":"1.1-a"}' } }] : []) }
  const [exercise] = questionsOf(document)
  const answer = { ...kept(1, 'solved'), quiz: '1.1-a', key: '1.1-a', kind: 'exercise' }
  assert.deepEqual(unpack(pack([answer], false)).answers, [answer])
  const record = Object.fromEntries(interaction(exercise, answer, new Date()))
  assert.equal(record.type, 'fill-in')
  assert.equal(record.student_response, 'solved')
  assert.equal(record.result, 'correct')
  assert.equal(grade([exercise], () => null, true).status, 'incomplete')
  assert.equal(grade([exercise], () => answer, false).status, 'passed')
})

test('it has room in 4096 characters, and the verdicts stay longest', () => {
  const answers = Array.from({ length: 30 }, (_, n) => kept(n, 'x'.repeat(10 + 40 * n)))
  const text = pack(answers, false)
  assert.ok(text.length <= 4096, String(text.length))
  const back = unpack(text).answers
  assert.equal(back.length, 30)
  assert.ok(back.some(({ given }) => given === null))
  assert.equal(back.find(({ key }) => key === 'key0').given, 'x'.repeat(10))
  const many = pack(Array.from({ length: 900 }, (_, n) => kept(n)), false)
  assert.ok(many.length <= 4096 && many.length > 3900, String(many.length))
  assert.ok(unpack(many).answers.some(({ key }) => key === 'key899'), 'the newest stays')
})

test('what is damaged is nothing', () => {
  for (const text of ['', 'x', '[]', 'null', '{"v":2,"q":{}}', '{"v":1,"q":null}', '{"v":1,"q":{"a":null}}', '{"v":1,"q":{"a":{"b":[9,1,1,1,1,1]}}}',
    '{"v":1,"q":{"a":{"b":[0,1,-1,1,1,1]}}}', '{"v":1,"q":{"a":{"b":[0,1,1,1,1,1e300]}}}', '{"v":1,"q":{"a":{"b":"x"}}}']) {
    assert.deepEqual(unpack(text), { answers: [], read: false })
  }
})

// --- the API

test('the API is found in windows above and in the one that opened this one, and circles end', () => {
  const API = {}
  const top = { API }
  top.parent = top
  const frame = { parent: { parent: top } }
  assert.equal(findApi(frame), API)
  const alone = { opener: { parent: top } }
  alone.parent = alone
  assert.equal(findApi(alone), API)
  const popup = { opener: top }
  popup.parent = popup
  assert.equal(findApi({ parent: popup, top: popup }), API)
  const circle = {}
  circle.parent = { parent: circle }
  assert.equal(findApi(circle), null)
  const foreign = { get API() { throw new Error('another host') }, parent: top }
  assert.equal(findApi({ parent: foreign }), API)
  const lonely = {}
  lonely.parent = lonely
  assert.equal(findApi(lonely), null)
})

// --- sessions

const answer = (given, right, lesson = '1.1') => ({ kind: 'mcq', given, right, tries: 1, hints: 0, number: 1, lesson, at: '2026-06-01T10:00:00.000Z' })

function storage(entries = {}) {
  const map = new Map(Object.entries(entries))
  return {
    getItem: (key) => map.get(key) ?? null,
    setItem: (key, value) => map.set(key, String(value)),
    removeItem: (key) => map.delete(key),
  }
}

function visitTo(api, { store = storage(), lesson = '1.1', now = () => 1e12 } = {}) {
  const session = beginSession(api, { now })
  const progress = openProgress('c', store, { now, events: null })
  return { session, progress, visit: new Visit(session, { lesson, course: 'c' }, progress, store) }
}

test('a whole visit says nothing that the data model does not have', () => {
  const api = new StrictApi()
  let time = 1e12
  const { session, visit } = visitTo(api, { now: () => time })
  assert.equal(api.values['cmi.core.lesson_status'], 'incomplete')
  visit.shows([mcq, several, number, order, output, open])
  visit.answered('q', 'k1', answer(['blue'], false))
  visit.answered('q', 'k1', answer(['green'], true))
  visit.answered('q', 'k2', answer(['red', 'blue'], true))
  visit.answered('q', 'k3', answer('0.08', true))
  visit.answered('q', 'k4', answer(['a', 'b', 'c'], true))
  visit.answered('q', 'k6', answer({ text: 'words', mark: 'good' }, true))
  assert.equal(api.values['cmi.core.lesson_status'], 'incomplete')
  assert.equal(api.values['cmi.core.score.raw'], '80')
  visit.answered('q', 'k5', answer('drift +6.6 %', true))
  assert.equal(api.values['cmi.core.lesson_status'], 'passed')
  visit.isAt('a-section')
  time += 90_000
  visit.ends()
  visit.ends()
  assert.deepEqual(api.errors, [])
  assert.deepEqual(session.trouble, [])
  assert.equal(api.state, 'over')
  assert.equal(api.calls.filter(([name]) => name === 'LMSFinish').length, 1)
  assert.equal(api.interactions.length, 7)
  assert.equal(api.values['cmi.core.score.raw'], '100')
  assert.equal(api.values['cmi.core.session_time'], '0000:01:30.00')
  assert.equal(api.values['cmi.core.exit'], 'suspend')
  assert.equal(api.values['cmi.core.lesson_location'], 'a-section')
})

test('a later visit goes on where the first ended, on another machine too', () => {
  const first = new StrictApi()
  const one = visitTo(first)
  one.visit.shows([mcq, number])
  one.visit.answered('q', 'k1', answer(['green'], true))
  one.visit.ends()
  const second = new StrictApi({ ...first.values })
  const two = visitTo(second)
  assert.deepEqual(two.progress.get('q', 'k1').given, ['green'])
  two.visit.shows([mcq, number])
  assert.equal(second.values['cmi.core.score.raw'], '50')
  two.visit.answered('q', 'k3', answer('1', false))
  assert.equal(second.values['cmi.core.lesson_status'], 'completed')
  assert.deepEqual(second.errors, [])
})

test('a status that was reached stays, also when the lesson gets another question', () => {
  const api = new StrictApi({ 'cmi.core.lesson_status': 'passed' })
  const { visit } = visitTo(api)
  visit.shows([mcq])
  visit.answered('q', 'k1', answer(['blue'], false))
  assert.equal(api.values['cmi.core.lesson_status'], 'passed')
  assert.equal(api.values['cmi.core.score.raw'], '0')
})

test('another learner at the same machine gets nothing of the first', () => {
  const store = storage()
  const one = visitTo(new StrictApi({ 'cmi.core.student_id': 'ada' }), { store })
  one.progress.put('q', 'k1', answer(['green'], true))
  assert.deepEqual(visitTo(new StrictApi({ 'cmi.core.student_id': 'ada' }), { store }).progress.get('q', 'k1').given, ['green'])
  const other = visitTo(new StrictApi({ 'cmi.core.student_id': 'emmy' }), { store })
  assert.equal(other.progress.get('q', 'k1'), null)
})

test('answers of before the platform knew this browser belong to nobody', () => {
  const store = storage()
  openProgress('c', store, { events: null }).put('q', 'k1', answer(['green'], true))
  assert.equal(visitTo(new StrictApi(), { store }).progress.get('q', 'k1'), null)
})

test('reading completes a lesson without questions', () => {
  const api = new StrictApi()
  const { visit } = visitTo(api)
  visit.shows([])
  assert.equal(api.values['cmi.core.lesson_status'], 'incomplete')
  visit.wasRead()
  assert.equal(api.values['cmi.core.lesson_status'], 'completed')
  assert.equal(api.values['cmi.core.score.raw'], undefined)
  visit.ends()
  const again = new StrictApi({ ...api.values })
  const { progress } = visitTo(again)
  assert.equal(progress.lessons().get('1.1').read, true)
})

test('answers on pages of other lessons are not this lesson’s', () => {
  const api = new StrictApi()
  const { visit } = visitTo(api)
  visit.shows([mcq])
  visit.answered('other', 'k9', answer(['x'], true, '1.2'))
  assert.equal(api.interactions.length, 0)
  assert.equal(api.values['cmi.core.score.raw'], '0')
})

test('who only looks is not recorded', () => {
  for (const mode of ['browse', 'review']) {
    const api = new StrictApi({ 'cmi.core.lesson_mode': mode })
    const { visit } = visitTo(api)
    visit.shows([mcq])
    visit.answered('q', 'k1', answer(['green'], true))
    visit.ends()
    assert.deepEqual(api.calls.filter(([name]) => name === 'LMSSetValue'), [])
    assert.equal(api.state, 'over')
  }
})

test('a platform that refuses or throws loses what it refused, and nothing else', () => {
  const api = new StrictApi()
  const set = api.LMSSetValue.bind(api)
  api.LMSSetValue = (name, value) => {
    if (name === 'cmi.suspend_data') throw new Error('no room')
    return name.startsWith('cmi.interactions') ? 'false' : set(name, value)
  }
  const { session, visit } = visitTo(api)
  visit.shows([mcq])
  visit.answered('q', 'k1', answer(['green'], true))
  visit.ends()
  assert.equal(api.values['cmi.core.lesson_status'], 'passed')
  assert.equal(api.state, 'over')
  assert.ok(session.trouble.length > 0)
})

test('a platform that knows only what every platform must know is told nothing else', () => {
  for (const interactions of ['', 'id, type, result', 'type,result']) {
    const api = new StrictApi({ 'cmi.core.score._children': 'raw', 'cmi.interactions._children': interactions.replaceAll(' ', '') })
    if (interactions.includes(' ')) {
      const get = api.LMSGetValue.bind(api)
      api.LMSGetValue = (name) => (name === 'cmi.interactions._children' ? interactions : get(name))
    }
    const { session, visit } = visitTo(api)
    visit.shows([mcq])
    visit.answered('q', 'k1', answer(['green'], true))
    visit.ends()
    assert.deepEqual(session.trouble, [])
    assert.deepEqual(api.errors.filter(([, name]) => name !== 'LMSGetValue'), [])
    assert.equal(api.values['cmi.core.lesson_status'], 'passed')
    assert.equal(api.interactions.length, Number(interactions.includes('id')))
  }
})

test('a platform that does not begin has no session', () => {
  const api = new StrictApi()
  api.LMSInitialize('')
  assert.equal(beginSession(api), null)
  assert.equal(beginSession({ LMSInitialize() { throw new Error('gone') } }), null)
  assert.equal(beginSession({}), null)
})

test('a closed storage is no reason not to record', () => {
  const closed = { getItem() { throw new Error('closed') }, setItem() { throw new Error('closed') }, removeItem() {} }
  const api = new StrictApi()
  const { visit } = visitTo(api, { store: closed })
  visit.shows([mcq])
  visit.answered('q', 'k1', answer(['green'], true))
  assert.equal(api.values['cmi.core.lesson_status'], 'passed')
  assert.deepEqual(api.errors, [])
})

test('a script gone wild does not fill the platform', () => {
  const api = new StrictApi()
  const { visit } = visitTo(api)
  visit.shows([mcq])
  for (let n = 0; n < 400; n++) visit.answered('q', 'k1', answer(['blue'], false))
  assert.equal(api.interactions.length, 250)
  assert.deepEqual(api.errors, [])
})

test('whatever is entered, the platform takes it', () => {
  const texts = ['', '\u0000', '\u202e', 'x'.repeat(5000), '😀'.repeat(300), '<b>', '1e999', '-', 'a,b', '{}', '\ud800']
  for (const question of [mcq, several, number, order, output, open]) {
    for (const given of [...texts, ...texts.map((text) => [text]), null, 7, {}, { text: 5 }]) {
      const api = new StrictApi()
      const { visit } = visitTo(api)
      visit.shows([question])
      visit.answered(question.quiz, question.key, answer(given, false))
      visit.ends()
      assert.deepEqual(api.errors, [], `${question.kind} ${JSON.stringify(given)}`)
    }
  }
})
