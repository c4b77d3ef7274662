import assert from 'node:assert/strict'
import { beforeEach, test } from 'node:test'

import { answer, isOurs } from '../js/offline/answer.js'
import { Files } from '../js/offline/fetching.js'
import { Store } from '../js/offline/store.js'
import { update } from '../js/offline/update.js'
import { FakeCaches, Host, SCOPE, built } from './offline-kit.mjs'

const COURSE = {
  'index.html': 'home',
  'offline/index.html': 'offline',
  'lessons/a.html': 'a',
  'data.csv': '0123456789',
  'assets/site.HASH.css': 'style',
  'assets/labs/m.HASH.wasm': 'engine',
}

let store, host, shown, work

beforeEach(async () => {
  store = new Store(new FakeCaches(), SCOPE)
  host = new Host(built(COURSE, { rest: ['assets/labs/'] }))
  shown = []
  work = []
  await update(store, new Files(SCOPE, host.fetch), { paths: [], keep: 'text', sparing: false, look: true, alone: true })
  host.since()
})

const request = (path, more = {}) => ({ url: SCOPE + path, method: 'GET', mode: 'no-cors', headers: new Headers(), ...more })
const around = (more = {}) => ({
  store,
  fetch: host.fetch,
  wait: () => new Promise(() => {}),
  waitUntil: (promise) => work.push(promise),
  onStored: (digest) => shown.push(digest),
  ...more,
})
const page = (path, more) => answer(request(path, { mode: 'navigate' }), around(more))
const path = (start) => [...host.files.keys()].find((one) => one.startsWith(start))

test('which requests are answered', () => {
  for (const one of ['', 'index.html', 'a.html?q=x', 'assets/x.js']) assert.ok(isOurs(request(one), SCOPE), one)
  for (const one of ['service-worker.js', 'files.json', '.coursebuild/events']) assert.ok(!isOurs(request(one), SCOPE), one)
  assert.ok(!isOurs(request('a.html', { method: 'POST' }), SCOPE))
  assert.ok(!isOurs({ ...request(''), url: 'https://example.org/other/' }, SCOPE))
  assert.ok(!isOurs({ ...request(''), url: 'https://example.com/course/' }, SCOPE))
})

test('a page comes from the network, what the browser began to fetch first', async () => {
  host.files.set('lessons/a.html', 'a, newer')
  assert.equal(await (await page('lessons/a.html')).text(), 'a, newer')
  assert.equal(await (await page('lessons/a.html', { preload: Promise.resolve(new Response('preloaded')) })).text(), 'preloaded')
  assert.deepEqual(host.since(), ['lessons/a.html'])
  assert.equal((await page('lessons/none.html')).status, 404)
  assert.deepEqual(shown, [])
})

test('a page that is kept is shown without a network, when the host fails, and when it takes too long', async () => {
  const failing = () => new Response('broken', { status: 503 })
  host.up = false
  assert.equal(await (await page('lessons/a.html?x=1#y')).text(), 'a')
  assert.equal(await (await page('lessons/a')).text(), 'a')
  assert.equal(await (await page('')).text(), 'home')
  assert.equal(await (await page('', { fetch: async () => failing() })).text(), 'home')
  assert.equal(await (await page('', { fetch: () => new Promise(() => {}), wait: async () => {} })).text(), 'home')
  assert.equal(await (await page('', { preload: Promise.reject(new TypeError('no network')) })).text(), 'home')
  assert.equal(shown.length, 6)
  assert.equal((await page('none.html', { fetch: async () => failing() })).status, 503)
})

test('a page that is not kept waits for a slow network', async () => {
  const slow = async () => {
    await new Promise((done) => setTimeout(done, 20))
    return new Response('at last')
  }
  assert.equal(await (await page('lessons/new.html', { fetch: slow, wait: async () => {} })).text(), 'at last')
})

test('a page that is not kept leads to the one that says so, and back', async () => {
  host.up = false
  const response = await page('lessons/new.html?q=1')
  assert.equal(response.status, 302)
  const there = new URL(response.headers.get('Location'))
  assert.equal(there.href.split('?')[0], `${SCOPE}offline/`)
  assert.equal(there.searchParams.get('from'), '/course/lessons/new.html?q=1')
  assert.equal(await (await page(`offline/${there.search}`)).text(), 'offline')
})

test('without anything kept, no network is no network', async () => {
  store = new Store(new FakeCaches(), SCOPE)
  host.up = false
  assert.equal((await page('lessons/a.html')).type, 'error')
  assert.equal((await page('offline/')).type, 'error')
})

test('a file with a hash in its name is not asked for twice', async () => {
  assert.equal(await (await answer(request(path('assets/site')), around())).text(), 'style')
  assert.deepEqual(host.since(), [])
  const engine = path('assets/labs/m')
  assert.equal(await (await answer(request(engine), around())).text(), 'engine')
  await Promise.all(work)
  host.up = false
  assert.equal(await (await answer(request(engine), around())).text(), 'engine')
})

test('a file whose name has a hash of something else goes by the list', async () => {
  host.files = built({ ...COURSE, 'assets/search/0.0123abcd.js': 'take()' })
  await update(store, new Files(SCOPE, host.fetch), { paths: [], keep: 'text', sparing: false, look: true, alone: true })
  host.up = false
  assert.equal(await (await answer(request('assets/search/0.0123abcd.js'), around())).text(), 'take()')
})

test('what is not what its name says is passed on and not kept', async () => {
  const engine = path('assets/labs/m')
  host.files.set(engine, '<p>Sorry</p>')
  assert.equal(await (await answer(request(engine), around())).text(), '<p>Sorry</p>')
  host.files.delete(engine)
  assert.equal((await answer(request(engine), around())).status, 404)
  await Promise.all(work)
  assert.equal(await store.get(engine, ''), undefined)
})

test('another file comes from the network, and from here without one', async () => {
  host.files.set('data.csv', 'newer')
  assert.equal(await (await answer(request('data.csv'), around())).text(), 'newer')
  host.up = false
  assert.equal(await (await answer(request('data.csv'), around())).text(), '0123456789')
  await assert.rejects(answer(request('none.csv'), around()), TypeError)
})

test('parts of files', async () => {
  host.up = false
  const ask = (range) => answer(request('data.csv', { headers: new Headers({ Range: range }) }), around())
  const some = await ask('bytes=2-4')
  assert.equal(some.status, 206)
  assert.equal(some.headers.get('Content-Range'), 'bytes 2-4/10')
  assert.equal(await some.text(), '234')
  assert.equal((await ask('bytes=50-')).status, 416)
})
