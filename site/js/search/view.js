/** Shows results as elements. Texts from the index become text nodes; none is parsed as HTML. */

import { form } from '../page/words.js'

/** An element with attributes and children; `null` children are left out. */
export function element(name, attributes = {}, ...children) {
  const node = document.createElement(name)
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== false) node.setAttribute(key, value === true ? '' : value)
  }
  node.append(...children.filter((child) => child !== null))
  return node
}

/** The nodes of a text with marks. */
export const markedText = (parts) => parts.map(({ text, isMarked }) => (isMarked ? element('mark', {}, text) : text))

/** The address of a page of the course, or of a place on it. */
export function address(root, path, anchor = '') {
  const encodedPath = path.split('/').map(encodeURIComponent).join('/')
  return root + encodedPath + (anchor ? `#${encodeURIComponent(anchor)}` : '')
}

/** The title of a page, with its number or its kind. */
export function pageTitle(page, strings) {
  const kind = strings[`kind_${page.kind}`] ?? strings.kind_page
  return [
    page.name ? element('span', { class: 'number' }, page.name) : null,
    page.name ? ' ' : null,
    ...markedText(page.title),
    page.kind === 'lesson' ? null : element('span', { class: 'found-kind' }, kind),
  ].filter((part) => part !== null)
}

/** A hit in a page: its headings, and an excerpt. */
export function hitParts({ trail, excerpt }) {
  const path = trail.flatMap((heading, index) => [
    ...(index > 0 ? [element('span', { class: 'found-step', 'aria-hidden': 'true' }, ' › ')] : []),
    ...markedText(heading),
  ])
  const hasExcerpt = excerpt && excerpt.parts.length > 0
  return [
    path.length > 0 ? element('span', { class: 'found-trail' }, ...path) : null,
    hasExcerpt ? element('span', { class: excerpt.code ? 'found-text found-code' : 'found-text' }, ...markedText(excerpt.parts)) : null,
  ].filter((part) => part !== null)
}

/** Put values into an interface text. */
export const fillIn = (text, values) => text.replace(/\{(\w+)\}/g, (match, key) => (key in values ? String(values[key]) : match))

/** The number of results, in words. */
export function summary(result, strings) {
  if (result.count === 0) return fillIn(strings.none, { query: result.query })
  const count = fillIn(form((key) => strings[key] ?? key, 'count', result.count), { n: result.count })
  const quoted = result.instead.map((word) => fillIn(strings.quoted, { word })).join(`${strings.comma} `)
  const instead = quoted ? fillIn(strings.instead, { words: quoted }) : ''
  return [`${count}.`, instead, result.complete ? '' : strings.part_failed].filter(Boolean).join(' ')
}
