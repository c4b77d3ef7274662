/** What a reader has done of a course, and where to go on; when a lesson counts as read. */

import './new-in-node.mjs'
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { markOf, nextUp, overview, readQuizzes, totals } from '../js/progress/course.js'
import { Reading } from '../js/progress/reading.js'
import { say } from '../js/page/words.js'
import { answer } from './progress-helpers.mjs'

const given = (quiz, key, own = {}) => ({ quiz, key, ...answer(own) })
const lesson = (id, text = '') => ({ id, quizzes: readQuizzes(text) })

test('the questions of a lesson are read from the page', () => {
  assert.deepEqual(readQuizzes('a%20%3A%2C:k1,k2 b:x'), [
    { id: 'a :,', questions: [{ key: 'k1', number: 1 }, { key: 'k2', number: 2 }] },
    { id: 'b', questions: [{ key: 'x', number: 1 }] },
  ])
  assert.deepEqual(readQuizzes(''), [])
  assert.deepEqual(readQuizzes(undefined), [])
  assert.deepEqual(readQuizzes('empty:'), [{ id: 'empty', questions: [] }])
})

test('lessons are read, begun, and right in all questions', () => {
  const lessons = [lesson('1.1', 'q:a,b'), lesson('1.2', 'r:a'), lesson('1.3'), lesson('1.4'), lesson('1.5', 's:a')]
  const answers = [given('q', 'a'), given('q', 'b', { number: 2 }), given('r', 'a', { right: false })]
  const kept = new Map([
    ['1.3', { read: true }],
    ['1.4', { read: false }],
  ])
  const { lessons: done, orphans } = overview(lessons, answers, kept)
  assert.deepEqual([...done].map(([id, state]) => [id, markOf(state)]), [
    ['1.1', 'right'],
    ['1.2', 'begun'],
    ['1.3', 'read'],
    ['1.4', 'begun'],
    ['1.5', ''],
  ])
  assert.deepEqual(totals([...done.values()]), { lessons: 5, read: 1, begun: 3, questions: 4, answered: 3, right: 2 })
  assert.deepEqual(orphans, { answers: [], lessons: [] })
})

test('what is no more is an orphan, and a question that was reworded or moved to another lesson is none', () => {
  const answers = [
    given('q', 'reworded', { number: 2 }),
    given('q', 'removed', { number: 9 }),
    given('moved', 'a', { lesson: '1.1' }),
    given('dropped', 'a'),
  ]
  const kept = new Map([['9.9', { read: true }]])
  const { lessons, answers: placed, orphans } = overview([lesson('1.1', 'q:a,b'), lesson('1.2', 'moved:a')], answers, kept)
  assert.equal(lessons.get('1.1').answered, 1)
  assert.deepEqual(placed.map(({ page, question }) => [page, question]), [
    ['1.1', 'b'],
    ['1.2', 'a'],
  ])
  assert.deepEqual(orphans.answers.map(({ quiz, key }) => [quiz, key]), [
    ['q', 'removed'],
    ['dropped', 'a'],
  ])
  assert.deepEqual(orphans.lessons, ['9.9'])
})

test('an undecided answer is answered and not right', () => {
  const { lessons } = overview([lesson('1', 'q:a')], [given('q', 'a', { right: null })], new Map())
  assert.deepEqual(lessons.get('1'), { read: false, begun: true, questions: 1, answered: 1, right: 0 })
})

test('the way on leads to where the reader was, else to the next lesson that is not read', () => {
  const order = ['1', '2', '3']
  const kept = (...read) => new Map(read.map((id) => [id, { read: true }]))
  const at = (id) => ({ id, section: 's', title: 'S' })
  const fresh = (id) => ({ id, section: '', title: '' })
  assert.equal(nextUp(order, null, kept()), null)
  assert.deepEqual(nextUp(order, at('2'), kept()), at('2'))
  assert.deepEqual(nextUp(order, at('2'), kept('2')), fresh('3'))
  assert.deepEqual(nextUp(order, at('3'), kept('3')), fresh('1'), 'what was left out comes at the end')
  assert.equal(nextUp(order, at('3'), kept('1', '2', '3')), 'all')
  assert.deepEqual(nextUp(order, null, kept('1')), fresh('2'))
  assert.deepEqual(nextUp(order, at('gone'), kept('1')), fresh('2'))
  assert.equal(nextUp([], at('gone'), kept()), null)
})

/** Read a text of `height` windows from top to bottom, with so many seconds for each window. */
function scroll(reading, height, seconds) {
  for (let at = 0; at <= height - 1; at += 0.5) {
    for (let n = 0; n < seconds; n++) reading.look(at / height, (at + 1) / height)
  }
}

test('a lesson is read when its end and enough of it were in sight for long enough', () => {
  const whole = new Reading()
  scroll(whole, 8, 2)
  assert.ok(whole.isRead)
  assert.equal(whole.share, 1)
})

test('a jump to the end, a fast scroll and a short look are no reading', () => {
  const jump = new Reading()
  for (let n = 0; n < 60; n++) jump.look(0.9, 1)
  assert.ok(!jump.isRead)
  const fast = new Reading()
  for (let at = 0; at <= 7; at++) fast.look(at / 8, (at + 1) / 8)
  assert.ok(!fast.isRead)
  const short = new Reading()
  for (let n = 0; n < 9; n++) short.look(0, 1)
  assert.ok(!short.isRead)
  short.look(0, 1)
  assert.ok(short.isRead, 'a lesson that fits into the window takes ten seconds')
})

test('what was seen before counts, and without the end nothing does', () => {
  const again = new Reading(0.7)
  assert.equal(again.share, 0.7)
  for (let n = 0; n < 10; n++) again.look(0.7, 0.99)
  assert.ok(!again.isRead)
  again.look(0.9, 1)
  again.look(0.9, 1)
  assert.ok(again.isRead)
})

test('a text out of the window, or without height, is not seen', () => {
  const reading = new Reading()
  for (const [from, to] of [[-3, -1], [1.2, 2], [NaN, NaN], [Infinity, Infinity], [-Infinity, Infinity]]) reading.look(from, to)
  assert.equal(reading.seconds, 1, 'only the last one holds the text')
  assert.equal(reading.share, 0)
})

test('a number chooses the form of a text', () => {
  const table = { plain: 'a {n} {title}', 'forms.one': '{n} lesson', 'forms.other': '{n} lessons' }
  const words = (key) => table[key] ?? key
  assert.equal(say(words, 'plain', { n: 1, title: '<b>' }), 'a 1 <b>')
  assert.equal(say(words, 'forms', { n: 1 }), '1 lesson')
  assert.equal(say(words, 'forms', { n: 0 }), '0 lessons')
})
