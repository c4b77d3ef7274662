/** Results as elements. What comes from the index is text and becomes text nodes: nothing of it is read as HTML. */

import { form } from '../page/words.js'

/** An element with attributes and children; `null` children are left out. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name)
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== false) made.setAttribute(key, value === true ? '' : value)
  }
  made.append(...children.filter((child) => child !== null))
  return made
}

/** Text with marks. */
export const markedText = (parts) => parts.map(({ text, marked }) => (marked ? element('mark', {}, text) : text))

/** The address of a page of the course, or of a place on it. */
export function address(root, path, anchor = '') {
  const encoded = path.split('/').map(encodeURIComponent).join('/')
  return root + encoded + (anchor ? `#${encodeURIComponent(anchor)}` : '')
}

/** Title of a page, with its number or what kind of page it is. */
export function pageTitle(page, strings) {
  const kind = strings[`kind_${page.kind}`] ?? strings.kind_page
  return [
    page.name ? element('span', { class: 'number' }, page.name) : null,
    page.name ? ' ' : null,
    ...markedText(page.title),
    page.kind === 'lesson' ? null : element('span', { class: 'found-kind' }, kind),
  ].filter((part) => part !== null)
}

/** What was found at a place of a page: its headings, and some words of it. */
export function hitParts({ trail, excerpt }) {
  const path = trail.flatMap((heading, at) => [
    ...(at > 0 ? [element('span', { class: 'found-step', 'aria-hidden': 'true' }, ' › ')] : []),
    ...markedText(heading),
  ])
  const shown = excerpt && excerpt.parts.length > 0
  return [
    path.length > 0 ? element('span', { class: 'found-trail' }, ...path) : null,
    shown ? element('span', { class: excerpt.code ? 'found-text found-code' : 'found-text' }, ...markedText(excerpt.parts)) : null,
  ].filter((part) => part !== null)
}

/** A text of the interface with values put in. */
export const filled = (text, values) => text.replace(/\{(\w+)\}/g, (all, key) => (key in values ? String(values[key]) : all))

/** How much was found, in words. */
export function summary(found, strings) {
  if (found.count === 0) return filled(strings.none, { query: found.query })
  const count = filled(form((key) => strings[key] ?? key, 'count', found.count), { n: found.count })
  const instead = found.instead.length > 0 ? filled(strings.instead, { words: found.instead.map((word) => `“${word}”`).join(', ') }) : ''
  return [`${count}.`, instead, found.complete ? '' : strings.part_failed].filter(Boolean).join(' ')
}
