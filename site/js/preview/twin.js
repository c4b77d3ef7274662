/**
 * A copy of the page as the server made it, beside the living page.
 *
 *   const twin = new Twin(element)          as soon as the element is parsed, before any other script
 *   const { added, removed } = twin.update(next)
 *
 * What scripts have made of the page since (buttons, running labs, open folds, answers) is not in the copy. An update compares the
 * server's old page with its new one, and changes in the living page only what differs between the two. So whatever the author did
 * not touch stays exactly as it is: focus, selection, open folds, running labs.
 */

import { align } from './align.js'

/** Elements that are replaced as a whole if anything in them differs. */
const WHOLE = new Set(['math', 'svg', 'video', 'audio', 'object', 'iframe', 'select', 'template'])

export class Twin {
  constructor(live) {
    this.liveNodes = new WeakMap()
    this.base = live.cloneNode(true)
    this.link(this.base, live)
  }

  /** Map each node of the server's page to its living node. */
  link(base, live) {
    this.liveNodes.set(base, live)
    const children = live.childNodes
    for (let i = 0; i < base.childNodes.length; i++) this.link(base.childNodes[i], children[i])
  }

  /** Map an unchanged part of a new page to the living nodes of the old one. */
  inherit(base, next) {
    this.liveNodes.set(next, this.liveNodes.get(base))
    for (let i = 0; i < base.childNodes.length; i++) this.inherit(base.childNodes[i], next.childNodes[i])
  }

  /** Update the living page to the server's new one. */
  update(next) {
    this.added = []
    this.removed = []
    this.updateElement(this.base, next)
    this.base = next
    return { added: this.added, removed: this.removed }
  }

  updateElement(base, next) {
    const live = this.liveNodes.get(base)
    this.liveNodes.set(next, live)
    updateAttributes(base, next, live)
    const before = [...base.childNodes]
    const after = [...next.childNodes]
    let previous = null // the living node after which the next one stands
    for (const [i, j] of align(before, after, isSame, isAlike)) {
      if (j === null) this.remove(before[i])
      else if (i === null) previous = this.insert(after[j], live, previous, before)
      else {
        this.updateNode(before[i], after[j])
        const node = this.liveNodes.get(after[j])
        if (node.parentNode === live) previous = node
      }
    }
  }

  updateNode(base, next) {
    if (isSame(base, next)) this.inherit(base, next)
    else if (base.nodeType !== Node.ELEMENT_NODE) this.updateText(base, next)
    else if (isWhole(base, next, this.liveNodes.get(base))) this.replace(base, next)
    else this.updateElement(base, next)
  }

  updateText(base, next) {
    const live = this.liveNodes.get(base)
    const { start, count, text } = difference(base.data, next.data)
    if (live.data === base.data) live.replaceData(start, count, text)
    else live.data = next.data
    this.liveNodes.set(next, live)
  }

  remove(base) {
    const live = this.liveNodes.get(base)
    if (live.nodeType === Node.ELEMENT_NODE) this.removed.push(live)
    live.remove()
  }

  insert(next, parent, previous, siblings) {
    const live = document.importNode(next, true)
    this.link(next, live)
    if (previous !== null) previous.after(live)
    else {
      const sibling = siblings.map((node) => this.liveNodes.get(node)).find((node) => node.parentNode === parent)
      if (sibling) sibling.before(live)
      else parent.append(live)
    }
    if (live.nodeType === Node.ELEMENT_NODE) this.added.push(live)
    return live
  }

  replace(base, next) {
    const old = this.liveNodes.get(base)
    const live = document.importNode(next, true)
    const folds = old.querySelectorAll('details')
    live.querySelectorAll('details').forEach((fold, index) => (fold.open ||= folds[index]?.open ?? false))
    this.link(next, live)
    this.removed.push(old)
    this.added.push(live)
    old.replaceWith(live)
  }
}

function isSame(first, second) {
  return first.isEqualNode(second) && (first.nodeName !== 'TEMPLATE' || first.innerHTML === second.innerHTML)
}

/** Whether one node may be changed into the other. */
function isAlike(first, second) {
  return first.nodeName === second.nodeName && key(first) === key(second)
}

/** The identity of an element, whatever it contains. */
function key(node) {
  if (node.nodeType !== Node.ELEMENT_NODE) return ''
  return node.id || node.dataset?.lab || node.dataset?.question || ''
}

/** Whether an element must be replaced, as it cannot be changed piece by piece. */
function isWhole(base, next, live) {
  if (WHOLE.has(base.localName)) return true
  if ('lab' in base.dataset) return base.dataset.config !== next.dataset.config || base.dataset.script !== next.dataset.script
  return 'question' in base.dataset && live.querySelector('form, fieldset') !== null
}

/** Change the attributes that differ, and of the classes only those that came or went. */
function updateAttributes(base, next, live) {
  for (const { name } of [...base.attributes]) {
    if (name !== 'class' && !next.hasAttribute(name)) live.removeAttribute(name)
  }
  for (const { name, value } of next.attributes) {
    if (name !== 'class' && base.getAttribute(name) !== value) live.setAttribute(name, value)
  }
  if (base.className === next.className) return
  live.classList.remove(...[...base.classList].filter((name) => !next.classList.contains(name)))
  live.classList.add(...[...next.classList].filter((name) => !base.classList.contains(name)))
}

/** The stretch of `before` to replace, and its replacement: `{start, count, text}`. Surrogate pairs are not split. */
export function difference(before, after) {
  const shortest = Math.min(before.length, after.length)
  let start = 0
  while (start < shortest && before[start] === after[start]) start++
  if (start > 0 && isHigh(before, start - 1)) start--
  let end = 0
  while (end < shortest - start && before[before.length - 1 - end] === after[after.length - 1 - end]) end++
  if (end > 0 && isLow(before, before.length - end)) end--
  return { start, count: before.length - end - start, text: after.slice(start, after.length - end) }
}

const isHigh = (text, index) => (text.charCodeAt(index) & 0xfc00) === 0xd800
const isLow = (text, index) => (text.charCodeAt(index) & 0xfc00) === 0xdc00
