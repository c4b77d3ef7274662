/**
 * The legend of a lab: an overlay, its entry and button, and its symbol in all formulas of the page light together.
 *
 *   const leave = followLegend(lab, point)    `point(name, isAsked)` draws the overlay `name`, or none for `null`
 */

const SCRIPTED = 'msub, msubsup, mover, munder, munderover' // whose first part is no symbol by itself; relations.py has them too
const MARKS = /(?: data-(?:term|lit)="")+/g
const pointers = new Map() // lab → its `point`

export function followLegend(lab, point) {
  const entries = lab.querySelectorAll('.lab-legend > li')
  if (entries.length === 0) return () => {}
  pointers.set(lab, point)
  for (const type of ['pointerover', 'focusin', 'click']) document.addEventListener(type, light)
  for (const entry of entries) for (const term of termsOf(entry)) term.toggleAttribute('data-term', true)
  return () => pointers.delete(lab)
}

const plain = (part) => part.outerHTML.replace(MARKS, '')

/** The symbol of an entry wherever a formula has it. @returns {Element[]} */
function termsOf(entry) {
  const symbol = entry.querySelector('semantics > :first-child')
  if (symbol === null) return []
  const text = plain(symbol)
  const isWhole = (part) => part.previousElementSibling !== null || !part.parentElement.matches(SCRIPTED)
  return [...document.querySelectorAll(`math ${symbol.localName}`)].filter((part) => isWhole(part) && plain(part) === text)
}

function light({ target, type }) {
  for (const part of document.querySelectorAll('[data-lit]')) part.removeAttribute('data-lit')
  const isNear = target instanceof Element && target.closest('[data-term], [data-overlay]') !== null
  for (const [lab, point] of pointers) {
    const groups = [...lab.querySelectorAll('.lab-legend > li')].map((entry) => {
      const { overlay } = entry.dataset
      return { overlay, parts: isNear ? [...lab.querySelectorAll(`[data-overlay="${overlay}"]`), ...termsOf(entry)] : [] }
    })
    const group = groups.find(({ parts }) => parts.some((part) => part.contains(target)))
    for (const part of group?.parts ?? []) part.toggleAttribute('data-lit', true)
    point(group?.overlay ?? null, type === 'click' && group !== undefined)
  }
}
