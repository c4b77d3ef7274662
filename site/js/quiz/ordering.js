/**
 * Items that are put in order: by a button for each direction, by arrow keys on these, or drawn by their grip.
 *
 * An item that has the focus or the pointer never leaves its place in the document, since it would lose both: the others move.
 */

import { gradeOrder } from './grade.js'
import { moved, placeAt, placed, restored } from './order.js'
import { fill, h, keysIn, shape, spoken } from './parts.js'

export class Ordering {
  constructor(question) {
    const { element, words } = question
    this.question = question
    this.words = words
    this.submit = words('quiz.live.check')
    this.answers = keysIn(element.dataset.answer)
    const list = element.querySelector(':scope > .items')
    this.first = [...list.children].map((item) => item.dataset.key)
    this.items = new Map([...list.children].map((item) => [item.dataset.key, this.#item(item)]))
    this.list = h('ol', { class: 'ordering' }, ...[...this.items.values()].map(({ item }) => item))
    this.said = h('p', { class: 'unseen', role: 'status' })
    this.body = h('div', {}, this.list, this.said)
    this.order = this.first
    list.remove()
    this.#ends()
  }

  #item(old) {
    const key = old.dataset.key
    const id = this.question.id(key)
    const text = h('span', { class: 'item-text', id }, ...old.childNodes)
    const mover = (name, by) => {
      const own = this.question.id(`${key}-${name}`)
      const label = this.words(`quiz.live.${name}`)
      const properties = { id: own, class: 'quiz-button quiz-move', title: label, 'aria-label': label, 'aria-labelledby': `${own} ${id}` }
      return h('button', { type: 'button', ...properties, onclick: () => this.move(key, by) }, shape(name))
    }
    const up = mover('up', -1)
    const down = mover('down', 1)
    const grip = h('span', { class: 'item-grip', onpointerdown: (event) => this.#draw(key, event) }, shape('grip'))
    const row = h('div', { class: 'item-row' }, grip, text, up, down)
    const item = h('li', { class: 'item', onkeydown: (event) => this.#key(key, event) }, row)
    item.dataset.key = key
    return { item, text, up, down, grip }
  }

  given() {
    return this.order
  }

  show(given) {
    if (!Array.isArray(given)) return false
    this.#arrange(restored(given, this.first))
    return true
  }

  clear() {
    this.#arrange(this.first)
  }

  focus() {
    this.items.get(this.order[0]).down.focus()
  }

  grade(given) {
    const { right, placed: count } = gradeOrder(given, this.answers)
    const more = right ? '' : fill(this.words('quiz.live.placed'), { count, all: this.answers.length })
    return { state: right ? 'right' : 'wrong', right, more }
  }

  mark() {}

  /** Move an item by some places, and say where it stands now. */
  move(key, by) {
    const order = moved(this.order, key, by)
    const changed = order.join(' ') !== this.order.join(' ')
    if (changed) {
      this.#arrange(order, key)
      this.question.touched()
    }
    this.#tell(key)
  }

  #tell(key) {
    const item = spoken(this.items.get(key).text)
    this.said.textContent = fill(this.words('quiz.live.moved'), { item, place: this.order.indexOf(key) + 1, all: this.order.length })
  }

  #arrange(order, kept = order[0]) {
    this.order = order
    const still = this.items.get(kept).item
    const at = order.indexOf(kept)
    for (const key of order.slice(0, at)) still.before(this.items.get(key).item)
    this.list.append(...order.slice(at + 1).map((key) => this.items.get(key).item))
    this.#ends()
  }

  /** What cannot go further says so; it keeps the focus all the same. */
  #ends() {
    this.order.forEach((key, place) => {
      const { up, down } = this.items.get(key)
      up.setAttribute('aria-disabled', String(place === 0))
      down.setAttribute('aria-disabled', String(place === this.order.length - 1))
    })
  }

  #key(key, event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return
    const by = { ArrowUp: -1, ArrowDown: 1, Home: -this.order.length, End: this.order.length }[event.key]
    if (by === undefined) return
    event.preventDefault()
    this.move(key, by)
  }

  #draw(key, down) {
    if (down.button !== 0) return
    down.preventDefault()
    const { item, grip } = this.items.get(key)
    const before = this.order
    grip.setPointerCapture(down.pointerId)
    item.classList.add('is-drawn')
    const follow = (event) => {
      const others = this.order.filter((other) => other !== key)
      const middles = others.map((other) => {
        const box = this.items.get(other).item.getBoundingClientRect()
        return (box.top + box.bottom) / 2
      })
      const order = placed(this.order, key, placeAt(event.clientY, middles))
      if (order.join(' ') !== this.order.join(' ')) this.#arrange(order, key)
    }
    const end = (event) => {
      grip.removeEventListener('pointermove', follow)
      grip.removeEventListener('pointerup', end)
      grip.removeEventListener('pointercancel', end)
      item.classList.remove('is-drawn')
      if (event.type === 'pointercancel') this.#arrange(before, key)
      if (this.order.join(' ') === before.join(' ')) return
      this.question.touched()
      this.#tell(key)
    }
    grip.addEventListener('pointermove', follow)
    grip.addEventListener('pointerup', end)
    grip.addEventListener('pointercancel', end)
  }
}
