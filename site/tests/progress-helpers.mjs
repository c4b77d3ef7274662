/** What the tests of progress share: random numbers that are the same each time, answers, and a browser's storage for several tabs. */

/** Numbers from 0 to 1 by mulberry32, the same for the same seed. */
export function random(seed) {
  let state = seed >>> 0
  return () => {
    state = (state + 0x6d2b79f5) | 0
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state)
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32
  }
}

/** An answer, with what is asked for. */
export function answer(own = {}) {
  return { kind: 'mcq', given: 'a1', right: true, tries: 1, hints: 0, number: 1, lesson: '1.1', at: '2026-01-01T10:00:00.000Z', ...own }
}

/** What several tabs share: each tab has a storage and hears of what the others write. */
export class Browser {
  items = new Map()
  room = Infinity
  #tabs = []

  /** A tab: its storage, and the target of its events. With `held` its events wait for `deliver`. */
  tab({ held = false } = {}) {
    const tab = { events: new EventTarget(), waiting: [], held }
    tab.storage = {
      getItem: (key) => this.items.get(key) ?? null,
      setItem: (key, value) => {
        const size = [...this.items].reduce((sum, [name, text]) => sum + (name === key ? 0 : text.length), String(value).length)
        if (size > this.room) throw new DOMException('no room', 'QuotaExceededError')
        this.items.set(key, String(value))
        this.#send(tab, key)
      },
      removeItem: (key) => {
        this.items.delete(key)
        this.#send(tab, key)
      },
    }
    tab.deliver = () => tab.waiting.splice(0).forEach((key) => dispatch(tab, key))
    this.#tabs.push(tab)
    return tab
  }

  /** What a browser does where the reader has it forget a site. */
  clear() {
    this.items.clear()
    this.#send(null, null)
  }

  #send(from, key) {
    for (const tab of this.#tabs) {
      if (tab === from) continue
      if (tab.held) tab.waiting.push(key)
      else dispatch(tab, key)
    }
  }
}

function dispatch(tab, key) {
  tab.events.dispatchEvent(Object.assign(new Event('storage'), { key }))
}
