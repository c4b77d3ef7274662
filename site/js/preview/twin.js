/**
 * The page as the server made it, beside the page as it is.
 *
 *   const twin = new Twin(element)          as soon as the element was parsed, before any other script
 *   const { added, removed } = twin.update(next)
 *
 * What scripts made of the page since (buttons, running labs, open folds, answers) is no part of what the server made. An update
 * compares the server's old page with its new one, and changes in the living page only what differs between these two. So whatever the
 * author did not touch stays exactly as it is: focus, selection, what is open, what runs.
 */

import { align } from './align.js'
import { stretch } from './text.js'

/** Elements that are one thing: where anything in them differs they are replaced. */
const WHOLE = new Set(['math', 'svg', 'video', 'audio', 'object', 'iframe', 'select', 'template'])

export class Twin {
  constructor(live) {
    this.of = new WeakMap()
    this.base = live.cloneNode(true)
    this.link(this.base, live)
  }

  /** Note which living node each node of the server's page became. */
  link(base, live) {
    this.of.set(base, live)
    const children = live.childNodes
    for (let i = 0; i < base.childNodes.length; i++) this.link(base.childNodes[i], children[i])
  }

  /** The same for a part of a new page that is no other than it was. */
  inherit(base, next) {
    this.of.set(next, this.of.get(base))
    for (let i = 0; i < base.childNodes.length; i++) this.inherit(base.childNodes[i], next.childNodes[i])
  }

  /** Make the page what the server makes of it now. */
  update(next) {
    this.added = []
    this.removed = []
    this.element(this.base, next)
    this.base = next
    return { added: this.added, removed: this.removed }
  }

  element(base, next) {
    const live = this.of.get(base)
    this.of.set(next, live)
    attributes(base, next, live)
    const before = [...base.childNodes]
    const after = [...next.childNodes]
    let previous = null // the living node after which the next one stands
    for (const [i, j] of align(before, after, same, alike)) {
      if (j === null) this.remove(before[i])
      else if (i === null) previous = this.insert(after[j], live, previous, before)
      else {
        this.pair(before[i], after[j])
        const here = this.of.get(after[j])
        if (here.parentNode === live) previous = here
      }
    }
  }

  pair(base, next) {
    if (same(base, next)) this.inherit(base, next)
    else if (base.nodeType !== Node.ELEMENT_NODE) this.text(base, next)
    else if (isWhole(base, next, this.of.get(base))) this.replace(base, next)
    else this.element(base, next)
  }

  text(base, next) {
    const live = this.of.get(base)
    const { start, count, text } = stretch(base.data, next.data)
    if (live.data === base.data) live.replaceData(start, count, text)
    else live.data = next.data
    this.of.set(next, live)
  }

  remove(base) {
    const live = this.of.get(base)
    if (live.nodeType === Node.ELEMENT_NODE) this.removed.push(live)
    live.remove()
  }

  insert(next, parent, previous, siblings) {
    const live = document.importNode(next, true)
    this.link(next, live)
    if (previous !== null) previous.after(live)
    else {
      const first = siblings.map((node) => this.of.get(node)).find((node) => node.parentNode === parent)
      if (first) first.before(live)
      else parent.append(live)
    }
    if (live.nodeType === Node.ELEMENT_NODE) this.added.push(live)
    return live
  }

  replace(base, next) {
    const old = this.of.get(base)
    const live = document.importNode(next, true)
    const folds = old.querySelectorAll('details')
    live.querySelectorAll('details').forEach((fold, index) => (fold.open ||= folds[index]?.open ?? false))
    this.link(next, live)
    this.removed.push(old)
    this.added.push(live)
    old.replaceWith(live)
  }
}

function same(one, two) {
  return one.isEqualNode(two) && (one.nodeName !== 'TEMPLATE' || one.innerHTML === two.innerHTML)
}

/** Whether one may become the other. */
function alike(one, two) {
  return one.nodeName === two.nodeName && key(one) === key(two)
}

/** What an element is known by, whatever is in it. */
function key(node) {
  if (node.nodeType !== Node.ELEMENT_NODE) return ''
  return node.id || node.dataset?.lab || node.dataset?.question || ''
}

/** Whether an element cannot become the other piece by piece. */
function isWhole(base, next, live) {
  if (WHOLE.has(base.localName)) return true
  if ('lab' in base.dataset) return base.dataset.config !== next.dataset.config || base.dataset.script !== next.dataset.script
  return 'question' in base.dataset && live.querySelector('form, fieldset') !== null
}

/** Change the attributes that differ; of classes only those that came or went. */
function attributes(base, next, live) {
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
