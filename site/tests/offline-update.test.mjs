import assert from 'node:assert/strict'
import { beforeEach, describe, test } from 'node:test'

import { Files } from '../js/offline/fetching.js'
import { Store } from '../js/offline/store.js'
import { update } from '../js/offline/update.js'
import { FakeCaches, Host, SCOPE, built } from './offline-kit.mjs'

const FIRST = {
  'index.html': 'home 1',
  'offline/index.html': 'offline',
  'assets/site.HASH.css': 'style 1',
  'lessons/a.html': 'a 1',
  'lessons/b.html': 'b',
  'lessons/gone.html': 'gone',
  'assets/labs/m.HASH.wasm': 'engine',
}
// The style is another one, and with it all pages but those that nothing links to.
const SECOND = {
  'index.html': 'home 2',
  'offline/index.html': 'offline',
  'assets/site.HASH.css': 'style 2',
  'lessons/a.html': 'a 2',
  'lessons/b.html': 'b',
  'lessons/new.html': 'new',
  'assets/labs/m.HASH.wasm': 'engine',
}
const LABS = { rest: ['assets/labs/'] }

let caches, store, host

beforeEach(() => {
  caches = new FakeCaches()
  store = new Store(caches, SCOPE)
  host = new Host(built(FIRST, LABS))
})

const visit = (wish = {}) =>
  update(new Store(caches, SCOPE), new Files(SCOPE, host.fetch), { paths: [], keep: 'auto', sparing: false, look: true, alone: true, ...wish })

/** What is here, as texts by path; of a path in two states both. */
async function here() {
  const found = {}
  for (const address of await store.keys()) {
    if (address.endsWith('?lists')) continue
    const cache = await caches.open(store.name)
    const path = decodeURIComponent(new URL(address).pathname.slice('/course/'.length)).replace(/\.[0-9a-f]{8}\./, '.HASH.')
    found[path] = [...(found[path] ?? []), await (await cache.match(address)).text()].sort()
  }
  return found
}

const single = (files, ...paths) => Object.fromEntries(paths.map((path) => [path, [files[path]]]))
const TEXT = ['assets/site.HASH.css', 'index.html', 'lessons/a.html', 'lessons/b.html', 'lessons/gone.html', 'offline/index.html']

describe('the first visit', () => {
  test('fetches the text, but no engine', async () => {
    assert.deepEqual(await visit(), { here: 6, total: 6, full: false, lost: false })
    assert.deepEqual(await here(), single(FIRST, ...TEXT))
  })

  test('fetches what every page needs and what was visited where the network is to be spared', async () => {
    await visit({ sparing: true, paths: ['lessons/a.html', 'lessons/no-such.html'] })
    assert.deepEqual(await here(), single(FIRST, 'assets/site.HASH.css', 'index.html', 'lessons/a.html', 'offline/index.html'))
  })

  test('fetches everything where that was asked for', async () => {
    const told = []
    await update(store, new Files(SCOPE, host.fetch), { paths: [], keep: 'all', sparing: true, look: true, alone: true }, (...how) => told.push(how))
    assert.deepEqual(await here(), single(FIRST, ...Object.keys(FIRST)))
    assert.deepEqual(told.at(-1), [7, 7])
  })

  test('keeps responses that can be given for pages', async () => {
    await visit()
    const { response, digest } = await store.find(['lessons/a.html'])
    assert.equal(response.redirected, false)
    assert.equal(response.headers.get('Content-Encoding'), null)
    assert.equal(response.headers.get('Content-Type'), 'text/html; charset=utf-8')
    assert.equal(digest.length, 12)
  })
})

describe('a further visit', () => {
  beforeEach(async () => {
    await visit()
    host.since()
  })

  test('asks for the list alone where nothing has changed, and for nothing where it asked just now', async () => {
    await visit()
    assert.deepEqual(host.since(), ['files.json'])
    await visit({ look: false })
    assert.deepEqual(host.since(), [])
  })

  test('fetches what has changed, and removes what is no more once nothing old is open', async () => {
    host.files = built(SECOND, LABS)
    await visit()
    const asked = host.since()
    assert.deepEqual(asked.filter((path) => !path.startsWith('assets/')), ['files.json', 'index.html', 'lessons/a.html', 'lessons/new.html'])
    assert.equal(asked.length, 5)
    const both = await here()
    assert.deepEqual(both['assets/site.HASH.css'], ['style 1', 'style 2'], 'a page that is open may still ask for the old one')
    await visit({ alone: false })
    assert.equal((await store.lists()).length, 2)
    await visit()
    assert.deepEqual(await here(), single(SECOND, ...TEXT.filter((path) => !path.includes('gone')), 'lessons/new.html'))
    assert.equal((await new Store(caches, SCOPE).lists()).length, 1)
  })

  test('leaves pages as they are, with what they need, while the network is to be spared', async () => {
    host.files = built(SECOND, LABS)
    await visit({ sparing: true, paths: ['lessons/b.html'] })
    await visit({ sparing: true })
    assert.equal((await new Store(caches, SCOPE).lists()).length, 2)
    const now = await here()
    assert.deepEqual(now['lessons/a.html'], ['a 1'])
    assert.deepEqual(now['assets/site.HASH.css'], ['style 1', 'style 2'])
    const fresh = new Store(caches, SCOPE)
    assert.equal(await (await fresh.find(['lessons/a.html'])).response.text(), 'a 1')
    assert.equal(await (await fresh.find(['index.html'])).response.text(), 'home 2')
  })

  test('holds no more than three lists', async () => {
    for (let build = 2; build < 7; build++) {
      host.files = built({ ...FIRST, 'index.html': `home ${build}` }, LABS)
      await visit({ alone: false })
    }
    assert.equal((await new Store(caches, SCOPE).lists()).length, 3)
    await visit()
    assert.deepEqual((await here())['index.html'], ['home 6'])
  })

  test('keeps what is here where the host does not answer, or has no list any more', async () => {
    host.up = false
    assert.equal((await visit()).lost, false, 'nothing is missing')
    host.up = true
    host.files = new Map()
    await visit()
    assert.deepEqual(await here(), single(FIRST, ...TEXT))
  })
})

describe('an update that does not come to its end', () => {
  for (let last = 0; last < 6; last++) {
    test(`leaves pages that fit together: the network fails after ${last} files`, async () => {
      await visit()
      host.files = built(SECOND, LABS)
      host.since()
      host.before = async () => {
        if (host.asked.length > last) throw new TypeError('no network')
      }
      await visit()
      host.before = async () => {}
      const fresh = new Store(caches, SCOPE)
      const { response } = await fresh.find(['index.html'])
      const style = (await response.text()).replace('home', 'style')
      const styles = (await here())['assets/site.HASH.css']
      assert.ok(styles.includes(style), `a page that needs ${style} is shown, and there is ${styles}`)
      await visit()
      await visit()
      assert.deepEqual(await here(), single(SECOND, ...TEXT.filter((path) => !path.includes('gone')), 'lessons/new.html'))
    })
  }

  test('because there is no room, keeps what fits and says so', async () => {
    caches.room = 5
    assert.deepEqual(await visit(), { here: 4, total: 6, full: true, lost: false })
    assert.deepEqual(Object.keys(await here()).sort().slice(0, 2), ['assets/site.HASH.css', 'index.html'])
    host.files = built(SECOND, LABS)
    const outcome = await visit()
    assert.equal(outcome.full, true)
    assert.equal(await (await new Store(caches, SCOPE).find(['index.html'])).response.text(), 'home 1', 'the older list stays whole')
  })
})

describe('a host', () => {
  test('that changes pages on their way is taken at its word; other files are not', async () => {
    for (const path of ['lessons/a.html', 'index.html']) host.files.set(path, `${host.files.get(path)}<script>counted</script>`)
    assert.equal((await visit()).lost, false)
    assert.deepEqual((await here())['lessons/a.html'], ['a 1<script>counted</script>'])
  })

  test('that answers with a page for what is missing poisons nothing', async () => {
    const fetch = host.fetch
    host.fetch = async (request, options) => {
      const response = await fetch(request, options)
      const page = () => new Response('<p>All is well</p>', { headers: { 'Content-Type': 'text/html' } })
      return /\.css$/.test(request.url ?? request) ? page() : response
    }
    assert.equal((await visit()).lost, true)
    assert.deepEqual(await new Store(caches, SCOPE).lists(), [], 'no list is taken without what every page needs')
  })

  test('that gets a new build meanwhile is asked again', async () => {
    let deployed = false
    host.before = async (path) => {
      if (path === 'lessons/a.html' && !deployed) {
        deployed = true
        host.files = built(SECOND, LABS)
      }
    }
    assert.equal((await visit()).lost, false)
    assert.equal(await (await new Store(caches, SCOPE).find(['lessons/a.html'])).response.text(), 'a 2')
    assert.ok((await here())['assets/site.HASH.css'].includes('style 2'))
  })

  test('that lacks a file of the list costs that file', async () => {
    host.files.delete('lessons/b.html')
    assert.deepEqual(await visit(), { here: 5, total: 6, full: false, lost: false })
  })

  test('that sends what is no list changes nothing', async () => {
    await visit()
    host.files.set('files.json', '<!DOCTYPE html><p>Log in to the network of this hotel</p>')
    await visit()
    assert.deepEqual(await here(), single(FIRST, ...TEXT))
    assert.equal((await new Store(caches, SCOPE).lists()).length, 1)
  })
})

describe('courses on one origin', () => {
  test('keep their files apart, and a damaged list counts as none', async () => {
    await visit()
    const other = new Store(caches, 'https://example.org/course/inner/')
    assert.equal(await other.find(['index.html']), null)
    await caches.open('coursebuild 0 https://example.org/course/')
    await caches.open('coursebuild 0 https://example.org/course/inner/')
    await caches.open('of somebody else')
    await store.removeOthers()
    const left = [store.name, other.name, 'coursebuild 0 https://example.org/course/inner/', 'of somebody else']
    assert.deepEqual((await caches.keys()).sort(), left.sort())
    const cache = await caches.open(store.name)
    await cache.put(`${SCOPE}?lists`, new Response('{"damaged'))
    assert.deepEqual(await new Store(caches, SCOPE).lists(), [])
    host.since()
    await visit()
    assert.deepEqual(host.since(), ['files.json'], 'the files themselves are found again')
  })
})
