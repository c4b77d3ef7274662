/**
 * Questions whose items are put in order: by a button for each direction, by arrow keys on these, or by dragging.
 *
 * An item that has the focus or the pointer is never moved in the document, since it would lose both: the other items are.
 */

import { textWithout } from '../page/select.js'
import { gradeOrder } from './grade.js'
import { fill, h, keysIn, shape } from './parts.js'

export class Ordering {
  constructor(question) {
    const { element, words } = question
    this.question = question
    this.words = words
    this.submit = words('quiz.live.check')
    this.answers = keysIn(element.dataset.answer)
    const list = element.querySelector(':scope > .items')
    this.initialOrder = [...list.children].map((item) => item.dataset.key)
    this.items = new Map([...list.children].map((item) => [item.dataset.key, this.#item(item)]))
    this.list = h('ol', { class: 'ordering' }, ...[...this.items.values()].map(({ item }) => item))
    this.status = h('p', { class: 'unseen', role: 'status' })
    this.body = h('div', {}, this.list, this.status)
    this.order = this.initialOrder
    list.remove()
    this.#updateButtons()
  }

  #item(old) {
    const key = old.dataset.key
    const id = this.question.id(key)
    const text = h('span', { class: 'item-text', id }, ...old.childNodes)
    const moveButton = (name, steps) => {
      const buttonId = this.question.id(`${key}-${name}`)
      const label = this.words(`quiz.live.${name}`)
      const properties = { id: buttonId, class: 'quiz-button quiz-move', title: label, 'aria-label': label, 'aria-labelledby': `${buttonId} ${id}` }
      return h('button', { type: 'button', ...properties, onclick: () => this.move(key, steps) }, shape(name))
    }
    const upButton = moveButton('up', -1)
    const downButton = moveButton('down', 1)
    const grip = h('span', { class: 'item-grip', onpointerdown: (event) => this.#startDrag(key, event) }, shape('grip'))
    const row = h('div', { class: 'item-row' }, grip, text, upButton, downButton)
    const item = h('li', { class: 'item', onkeydown: (event) => this.#onKey(key, event) }, row)
    item.dataset.key = key
    return { item, text, up: upButton, down: downButton, grip }
  }

  entry() {
    return this.order
  }

  show(entry) {
    this.#arrange(restoreOrder(entry, this.initialOrder))
    return Array.isArray(entry)
  }

  focus() {
    this.items.get(this.order[0]).down.focus()
  }

  grade(entry) {
    const { right, placedCount: count } = gradeOrder(entry, this.answers)
    const more = right ? '' : fill(this.words('quiz.live.placed'), { count, all: this.answers.length })
    return { state: right ? 'right' : 'wrong', right, more }
  }

  mark() {}

  /** Move an item by some places, and announce its new place. */
  move(key, steps) {
    const order = moveBy(this.order, key, steps)
    const hasChanged = order.join(' ') !== this.order.join(' ')
    if (hasChanged) {
      this.#arrange(order, key)
      this.question.onEdit()
    }
    this.#announce(key)
  }

  #announce(key) {
    const item = textWithout(this.items.get(key).text, 'annotation, annotation-xml') // as it is read aloud
    this.status.textContent = fill(this.words('quiz.live.moved'), { item, place: this.order.indexOf(key) + 1, all: this.order.length })
  }

  #arrange(order, fixedKey = order[0]) {
    this.order = order
    const still = this.items.get(fixedKey).item
    const index = order.indexOf(fixedKey)
    for (const key of order.slice(0, index)) still.before(this.items.get(key).item)
    this.list.append(...order.slice(index + 1).map((key) => this.items.get(key).item))
    this.#updateButtons()
  }

  /** Disable buttons at the ends, by ARIA only, so that they keep the focus. */
  #updateButtons() {
    this.order.forEach((key, place) => {
      const { up, down } = this.items.get(key)
      up.setAttribute('aria-disabled', String(place === 0))
      down.setAttribute('aria-disabled', String(place === this.order.length - 1))
    })
  }

  #onKey(key, event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return
    const steps = { ArrowUp: -1, ArrowDown: 1, Home: -this.order.length, End: this.order.length }[event.key]
    if (steps === undefined) return
    event.preventDefault()
    this.move(key, steps)
  }

  #startDrag(key, press) {
    if (press.button !== 0) return
    press.preventDefault()
    const { item, grip } = this.items.get(key)
    const previousOrder = this.order
    grip.setPointerCapture(press.pointerId)
    item.classList.add('is-drawn')
    const follow = (event) => {
      const otherKeys = this.order.filter((otherKey) => otherKey !== key)
      const middles = otherKeys.map((otherKey) => {
        const box = this.items.get(otherKey).item.getBoundingClientRect()
        return (box.top + box.bottom) / 2
      })
      const order = moveTo(this.order, key, placeAt(event.clientY, middles))
      if (order.join(' ') !== this.order.join(' ')) this.#arrange(order, key)
    }
    const end = (event) => {
      grip.removeEventListener('pointermove', follow)
      grip.removeEventListener('pointerup', end)
      grip.removeEventListener('pointercancel', end)
      item.classList.remove('is-drawn')
      if (event.type === 'pointercancel') this.#arrange(previousOrder, key)
      if (this.order.join(' ') === previousOrder.join(' ')) return
      this.question.onEdit()
      this.#announce(key)
    }
    grip.addEventListener('pointermove', follow)
    grip.addEventListener('pointerup', end)
    grip.addEventListener('pointercancel', end)
  }
}

// --- orders, as lists of keys

/** Move an item by some places; it stops at the ends. */
export function moveBy(order, key, steps) {
  return moveTo(order, key, order.indexOf(key) + steps)
}

export function moveTo(order, key, place) {
  return order.filter((item) => item !== key).toSpliced(Math.max(place, 0), 0, key)
}

/**
 * Adapt a stored order to the present items: removed ones are left out, new ones come at the end.
 * @param {unknown} storedOrder
 * @param {string[]} present
 */
export function restoreOrder(storedOrder, present) {
  if (!Array.isArray(storedOrder)) return [...present]
  const valid = [...new Set(storedOrder)].filter((key) => present.includes(key))
  return [...valid, ...present.filter((key) => !valid.includes(key))]
}

/**
 * The place for a dragged item: the number of other items whose middle is above the pointer.
 * @param {number} y of the pointer
 * @param {number[]} middles of the other items, in their order
 */
export function placeAt(y, middles) {
  return middles.filter((middle) => middle < y).length
}
