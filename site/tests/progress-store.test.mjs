/** A reader's progress in a browser's storage: several tabs, several devices, and everything that can be wrong with a storage. */

import assert from 'node:assert/strict'
import { test } from 'node:test'
import { ImportError, importText } from '../js/progress/exchange.js'
import { matchQuestions } from '../js/progress/match.js'
import { openProgress } from '../js/progress/store.js'
import { answer, Browser, random } from './progress-helpers.mjs'

const NAME = 'coursebuild.progress.c'
const DAY = 86_400_000

/** A clock that can be set. */
function clock(start = Date.UTC(2026, 0, 1)) {
  const now = () => now.time
  now.time = start
  return now
}

function open(browser = new Browser(), { held = false, now = clock(), course = 'c' } = {}) {
  const tab = browser.tab({ held })
  return Object.assign(openProgress(course, tab.storage, { now, events: tab.events }), { tab, now })
}

test('an answer is there after the page is opened again', () => {
  const browser = new Browser()
  const one = open(browser)
  assert.equal(one.get('q', 'k'), null)
  one.put('q', 'k', answer({ given: ['b', 'a'], right: false }))
  assert.deepEqual(open(browser).get('q', 'k'), answer({ given: ['b', 'a'], right: false }))
  assert.deepEqual([...browser.items.keys()], [NAME])
  assert.equal(open(browser, { course: 'd' }).get('q', 'k'), null, 'another course')
})

test('what is kept is not what whoever put it goes on changing', () => {
  const progress = open()
  const given = ['a']
  progress.put('q', 'k', answer({ given }))
  given.push('b')
  assert.deepEqual(progress.get('q', 'k').given, ['a'])
})

test('an answer that is none is refused and changes nothing', () => {
  const progress = open()
  for (const own of [{ right: 'yes' }, { tries: -1 }, { kind: undefined }, { given: [[[[['x']]]]] }]) {
    assert.throws(() => progress.put('q', 'k', answer(own)))
  }
  assert.deepEqual(progress.all(), [])
})

test('whatever the clock says, what is kept can be read again', () => {
  for (const time of [-1e15, 0, 1.5, 8e15, 1e300]) {
    const browser = new Browser()
    const progress = open(browser, { now: clock(time) })
    for (const at of [undefined, 'now', '+275760-09-13T00:00:00.000Z']) progress.put('q', String(at), answer({ right: false, at }))
    progress.markLesson('1.1', true)
    progress.readLesson('1.1', { anchor: '', share: 0.5 })
    assert.equal(open(browser).all().length, 3)
    assert.equal(open(browser).trouble(), null)
    assert.ok(open(browser).lessons().get('1.1').read)
  }
})

test('a missed question has a recall, tries after it and answers without a verdict have none', () => {
  const progress = open()
  progress.put('q', 'k', answer({ right: null, tries: 0 }))
  progress.put('q', 'k', answer({ right: false, tries: 1 }))
  progress.now.time += 60_000
  progress.put('q', 'k', answer({ right: false, tries: 1, hints: 1 }))
  progress.put('q', 'k', answer({ right: true, tries: 2, hints: 1 }))
  const [{ recalls, right }] = progress.all()
  assert.equal(right, true)
  assert.deepEqual(recalls.map((recall) => recall.right), [false])
})

test('the same answer again is a recall where the caller says so', () => {
  const progress = open()
  progress.put('q', 'k', answer({ right: false }))
  progress.put('q', 'k', answer({ right: true }))
  progress.now.time += 2 * DAY
  progress.put('q', 'k', answer({ right: true }))
  assert.equal(progress.all()[0].recalls.length, 1)
  progress.put('q', 'k', answer({ right: true }), { recall: true })
  assert.deepEqual(progress.all()[0].recalls.map(({ right }) => right), [false, true])
})

test('lessons: how far, where last, read or not', () => {
  const progress = open()
  assert.equal(progress.last(), null)
  progress.readLesson('4.2', { anchor: 'energy', title: 'Energy <b>', share: 0.5 })
  progress.readLesson('4.1', { anchor: '', share: 0 })
  assert.equal(progress.last().id, '4.1')
  progress.now.time -= DAY
  progress.readLesson('4.2', { anchor: 'work', title: 'Work', share: 0.25 })
  assert.equal(progress.last().id, '4.2', 'whatever the clock says')
  assert.equal(progress.last().section, 'work')
  progress.markLesson('4.1', true)
  assert.equal(progress.lessons().get('4.1').read, true)
  progress.markLesson('4.1', false)
  assert.equal(progress.lessons().get('4.1').read, false)
  assert.equal(progress.lessons().get('4.2').place.share, 0.25)
  progress.forgetLesson('4.2')
  assert.deepEqual([...progress.lessons().keys()], ['4.1'])
})

test('two tabs see what the other does', () => {
  const browser = new Browser()
  const [one, two] = [open(browser), open(browser)]
  const heard = []
  const stop = two.onChange(({ isLocal }) => heard.push(isLocal))
  one.put('q', 'k', answer())
  assert.deepEqual(two.get('q', 'k'), answer())
  two.put('q', 'l', answer())
  assert.deepEqual(heard, [false, true])
  stop()
  one.markLesson('1.1', true)
  assert.equal(heard.length, 2)
  assert.equal(one.all().length, 2)
})

test('a tab that has heard nothing yet writes over nothing', () => {
  const browser = new Browser()
  const [one, two] = [open(browser, { held: true }), open(browser, { held: true })]
  one.put('q', 'k', answer())
  two.put('q', 'l', answer())
  one.put('q', 'm', answer())
  assert.equal(open(browser).all().length, 3)
})

test('texts that two tabs wrote at the same moment are merged when they hear of each other', () => {
  const browser = new Browser()
  const [one, two] = [open(browser, { held: true }), open(browser, { held: true })]
  one.put('q', 'k', answer())
  const lost = browser.items.get(NAME)
  browser.items.delete(NAME)
  const three = open(browser) // knows nothing of it
  three.put('q', 'l', answer())
  const written = browser.items.get(NAME)
  // As if `one` had read before `three` wrote: its memory has what the storage lacks.
  assert.notEqual(lost, written)
  one.tab.deliver()
  two.tab.deliver()
  assert.deepEqual(open(browser).all().map(({ key }) => key).sort(), ['k', 'l'])
  assert.deepEqual(three.all().map(({ key }) => key).sort(), ['k', 'l'])
})

test('a reset holds against a tab that still remembers, and against an older file', () => {
  const browser = new Browser()
  const [one, two] = [open(browser), open(browser, { held: true })]
  two.put('q', 'k', answer())
  const file = two.exportText()
  one.reset()
  two.put('q', 'l', answer())
  two.tab.deliver()
  assert.deepEqual(open(browser).all().map(({ key }) => key), ['l'])
  assert.deepEqual(importText(one, file), { answers: 0, lessons: 0, restorable: 1 })
  assert.equal(one.get('q', 'k'), null)
})

test('what a reset took can be brought back from a file, once, and is then like any other', () => {
  const browser = new Browser()
  const one = open(browser)
  one.put('q', 'k', answer({ right: false }))
  one.markLesson('1.1', true)
  one.readLesson('1.2', { anchor: '', share: 0 })
  const file = one.exportText()
  one.reset()
  one.put('q', 'new', answer())
  one.markLesson('1.2', false)
  assert.deepEqual(importText(one, file), { answers: 0, lessons: 0, restorable: 3 })
  assert.deepEqual(importText(one, file, { restore: true }), { answers: 1, lessons: 2, restorable: 0 })
  assert.deepEqual(importText(one, file, { restore: true }), { answers: 0, lessons: 0, restorable: 0 })
  assert.deepEqual(one.get('q', 'k'), answer({ right: false }))
  assert.equal(one.all().find(({ key }) => key === 'k').recalls.length, 1, 'it comes back for review')
  assert.equal(one.lessons().get('1.1').read, true)
  assert.deepEqual(one.lessons().get('1.2').place.share, 0)
  assert.equal(open(browser).all().length, 2)
})

test('a removed answer stays removed where an older state is merged, and can be given anew', () => {
  const browser = new Browser()
  const one = open(browser)
  one.put('q', 'k', answer({ right: false }))
  const file = one.exportText()
  one.forget('q', 'k')
  assert.equal(importText(one, file).answers, 0)
  assert.deepEqual(one.all(), [])
  one.put('q', 'k', answer())
  assert.deepEqual(one.all()[0].recalls, [])
})

test('an answer goes by the new key of its question, with its recalls, and the old one does not come back', () => {
  const progress = open()
  progress.put('q', 'old', answer({ right: false }))
  const file = progress.exportText()
  progress.rename('q', 'old', 'new')
  assert.deepEqual(progress.all().map(({ key, recalls }) => [key, recalls.length]), [['new', 1]])
  importText(progress, file)
  assert.deepEqual(progress.all().map(({ key }) => key), ['new'])
  progress.put('q', 'third', answer())
  progress.rename('q', 'third', 'new')
  progress.rename('q', 'missing', 'new')
  progress.rename('q', 'new', 'new')
  assert.deepEqual(progress.all().map(({ key }) => key).sort(), ['new', 'third'], 'what is there stays')
})

test('nothing is read before somebody asks', () => {
  const storage = { getItem: () => assert.fail('read'), setItem: assert.fail }
  openProgress('c', storage, { events: new EventTarget() })
})

test('a browser whose storage is emptied forgets', () => {
  const browser = new Browser()
  const [one, two] = [open(browser), open(browser)]
  one.put('q', 'k', answer())
  browser.clear()
  assert.deepEqual(two.all(), [])
  two.put('q', 'l', answer())
  assert.deepEqual(open(browser).all().map(({ key }) => key), ['l'])
})

test('two devices exchange files', () => {
  const [desk, phone] = [open(new Browser()), open(new Browser(), { now: clock(Date.UTC(2031, 0, 1)) })]
  desk.put('q', 'both', answer({ given: 'desk' }))
  desk.put('q', 'desk', answer())
  desk.markLesson('1.1', true)
  phone.put('q', 'both', answer({ given: 'phone', right: false }))
  phone.readLesson('1.1', { anchor: 'start', title: 'Start', share: 0.1 })
  assert.deepEqual(importText(desk, phone.exportText()), { answers: 1, lessons: 1, restorable: 0 })
  assert.deepEqual(importText(phone, desk.exportText()), { answers: 1, lessons: 1, restorable: 0 })
  assert.equal(desk.exportText(), phone.exportText())
  assert.equal(phone.lessons().get('1.1').read, true, 'opening a lesson elsewhere does not make it unread')
  // The phone’s clock is years ahead; what is done later on the desk counts all the same.
  desk.put('q', 'both', answer({ given: 'desk again' }))
  importText(phone, desk.exportText())
  assert.equal(phone.get('q', 'both').given, 'desk again')
})

test('files that are none of this course’s progress are refused by name, and change nothing', () => {
  const browser = new Browser()
  const progress = open(browser)
  progress.put('q', 'k', answer())
  const own = progress.exportText()
  const other = open(new Browser(), { course: 'other' })
  const cases = {
    json: ['', '{', '\u0000', '<html>', '[1,', own.slice(0, -20)],
    kind: ['[]', 'null', '3', '"x"', '{}', '{"version":1}', '{"coursebuild":"progress"}', own.replace('"version":1', '"version":"1"')],
    version: [own.replace('"version":1', '"version":2')],
    course: [other.exportText(), own.replace('"c"', 'null')],
    entry: [
      own.replace('"tries":1', '"tries":"<img src=x onerror=alert(1)>"'),
      own.replace('"lessons":{}', '"lessons":{"__proto__":{"polluted":{}}}'),
      own.replace('"lessons":{}', '"lessons":[]'),
      own.replace('"reset":0', '"reset":1e300'),
      own.replace(/"tick":\d+/, '"tick":9007199254740993'),
      `{"coursebuild":"progress","version":1,"course":"c","reset":0,"answers":${'{"a":'.repeat(5000)}1${'}'.repeat(5000)},"lessons":{}}`,
    ],
    size: [' '.repeat(33 * 2 ** 20)],
  }
  for (const [code, texts] of Object.entries(cases)) {
    for (const text of texts) {
      assert.throws(() => importText(progress, text), (error) => error instanceof ImportError && error.code === code, `${code}: ${text.slice(0, 90)}`)
    }
  }
  assert.equal(progress.exportText(), own)
  assert.equal(browser.items.get(NAME), own)
  assert.equal({}.polluted, undefined)
})

test('names that objects have anyhow are names like others', () => {
  const browser = new Browser()
  const progress = open(browser)
  for (const name of ['__proto__', 'constructor', 'toString', '']) progress.put(name, name, answer({ lesson: name }))
  progress.markLesson('__proto__', true)
  assert.equal(open(browser).all().length, 4)
  assert.equal(importText(open(new Browser()), progress.exportText()).answers, 4)
  assert.ok(open(browser).lessons().get('__proto__').read)
})

test('a storage that is closed, in every way, keeps for this page', () => {
  const broken = () => {
    throw new DOMException('no', 'SecurityError')
  }
  for (const storage of [null, { getItem: broken, setItem: broken, removeItem: broken }]) {
    const progress = openProgress('c', storage, { events: new EventTarget() })
    assert.equal(progress.trouble(), 'closed')
    progress.put('q', 'k', answer())
    progress.markLesson('1.1', true)
    assert.deepEqual(progress.get('q', 'k'), answer())
    assert.equal(importText(progress, progress.exportText()).answers, 0)
    progress.reset()
    assert.deepEqual(progress.all(), [])
    assert.equal(progress.damagedText(), null)
    progress.dropDamaged()
  }
  Object.defineProperty(globalThis, 'localStorage', { configurable: true, get: broken })
  assert.equal(openProgress('c').trouble(), 'closed')
  delete globalThis.localStorage
})

test('a full storage keeps for this page, and all of it as soon as there is room', () => {
  const browser = new Browser()
  const progress = open(browser)
  progress.put('q', 'k', answer())
  browser.room = browser.items.get(NAME).length + 10
  progress.put('q', 'l', answer())
  assert.equal(progress.trouble(), 'full')
  assert.deepEqual(progress.get('q', 'l'), answer())
  assert.equal(open(browser).get('q', 'l'), null)
  browser.room = Infinity
  progress.put('q', 'm', answer())
  assert.equal(progress.trouble(), null)
  assert.equal(open(browser).all().length, 3)
})

test('an import for which there is no room changes nothing', () => {
  const other = open()
  for (let n = 0; n < 50; n++) other.put('q', `k${n}`, answer())
  const browser = new Browser()
  const progress = open(browser)
  progress.put('q', 'mine', answer())
  const before = progress.exportText()
  browser.room = before.length + 100
  const heard = []
  progress.onChange(() => heard.push(1))
  assert.throws(() => importText(progress, other.exportText()), { code: 'full' })
  assert.equal(progress.exportText(), before)
  assert.equal(progress.trouble(), null)
  assert.deepEqual(heard, [])
})

test('a damaged text is put aside, what can be read of it is taken over', () => {
  for (const [damage, left] of [
    [(text) => text.slice(0, -9), []],
    [() => '', []],
    [() => '[]', []],
    [(text) => text.replace('"c"', '"d"'), []],
    [(text) => text.replace('"tries":1', '"tries":-1'), ['l']],
  ]) {
    const browser = new Browser()
    const writer = open(browser, { held: true })
    writer.put('q', 'k', answer())
    writer.put('q', 'l', answer({ tries: 2 }))
    const damaged = damage(browser.items.get(NAME))
    browser.items.set(NAME, damaged)
    const progress = open(browser)
    assert.equal(progress.trouble(), 'damaged')
    assert.deepEqual(progress.all().map(({ key }) => key), left)
    assert.equal(browser.items.get(NAME), damaged, 'reading changes nothing')
    progress.put('q', 'm', answer())
    assert.deepEqual(open(browser).all().map(({ key }) => key), [...left, 'm'])
    assert.equal(open(browser).trouble(), null)
    assert.equal(progress.damagedText(), damaged)
    progress.dropDamaged()
    assert.equal(progress.damagedText(), null)
  }
})

test('a damaged text for which there is no room elsewhere is not written over', () => {
  const browser = new Browser()
  browser.items.set(NAME, '{'.repeat(100))
  browser.room = 150
  const progress = open(browser)
  progress.put('q', 'k', answer())
  assert.equal(browser.items.get(NAME), '{'.repeat(100))
  assert.deepEqual(progress.get('q', 'k'), answer())
})

test('what a newer version has written is not touched', () => {
  const browser = new Browser()
  browser.items.set(NAME, '{"coursebuild":"progress","version":2,"course":"c","news":[]}')
  const progress = open(browser)
  assert.equal(progress.trouble(), 'newer')
  progress.put('q', 'k', answer())
  progress.reset()
  assert.match(browser.items.get(NAME), /"version":2/)
  assert.equal(browser.items.size, 1)
})

test('answers find their questions again by key, else by number and kind', () => {
  const kept = [
    { key: 'a', kind: 'mcq', number: 1 },
    { key: 'old', kind: 'numeric', number: 2 },
    { key: 'gone', kind: 'open', number: 3 },
    { key: 'moved', kind: 'mcq', number: 4 },
  ]
  const present = [
    { key: 'moved', kind: 'mcq', number: 1 },
    { key: 'new', kind: 'numeric', number: 2 },
    { key: 'other', kind: 'order', number: 3 },
    { key: 'a', kind: 'mcq', number: 4 },
  ]
  const { matched: found, orphans } = matchQuestions(kept, present)
  assert.deepEqual([...found].map(([key, answer]) => [key, answer.key]).sort(), [
    ['a', 'a'],
    ['moved', 'moved'],
    ['new', 'old'],
  ])
  assert.deepEqual(orphans.map(({ key }) => key), ['gone'])
  assert.deepEqual(matchQuestions([], present).orphans, [])
  const twins = [1, 2].map((n) => ({ key: `old${n}`, kind: 'mcq', number: 1 }))
  assert.equal(matchQuestions(twins, [{ key: 'new', kind: 'mcq', number: 1 }]).orphans.length, 1, 'none is taken twice')
})

test('random histories of tabs and devices end in the same state everywhere', () => {
  const draw = random(11)
  for (let round = 0; round < 30; round++) {
    const devices = [0, 1].map((n) => {
      const browser = new Browser()
      const now = clock(Date.UTC(2026 + 3 * n, 0, 1))
      return { browser, tabs: [open(browser, { held: true, now }), open(browser, { held: true, now })], now }
    })
    for (let step = 0; step < 60; step++) {
      const device = devices[Math.floor(draw() * 2)]
      const tab = device.tabs[Math.floor(draw() * 2)]
      device.now.time += Math.floor((draw() - 0.3) * DAY)
      const key = `k${Math.floor(draw() * 4)}`
      const act = Math.floor(draw() * 12)
      if (act < 4) tab.put('q', key, answer({ given: String(step), right: draw() < 0.5, tries: Math.floor(draw() * 3) }))
      else if (act < 5) tab.forget('q', key)
      else if (act < 6) tab.markLesson(key, draw() < 0.5)
      else if (act < 7) tab.readLesson(key, { anchor: String(step), share: draw() })
      else if (act < 8 && draw() < 0.2) tab.reset()
      else if (act < 10) tab.tab.deliver()
      else importText(tab, devices[1 - devices.indexOf(device)].tabs[0].exportText())
    }
    const [one, two] = devices.map(({ tabs }) => tabs[0])
    importText(one, two.exportText())
    importText(two, one.exportText())
    for (let n = 0; n < 3; n++) devices.forEach(({ tabs }) => tabs.forEach(({ tab }) => tab.deliver()))
    const texts = devices.flatMap(({ browser, tabs }) => [browser.items.get(NAME), ...tabs.map((tab) => tab.exportText())])
    assert.equal(new Set(texts).size, 1)
  }
})
