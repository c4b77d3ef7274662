/** Shows results as elements. Texts from the index become text nodes; none is parsed as HTML. */

import { h } from '../lab/page/dom.js'
import { fill, say } from '../page/words.js'

/** The nodes of a text with marks. */
const markedText = (parts) => parts.map(({ text, isMarked }) => (isMarked ? h('mark', {}, text) : text))

/** The address of a page of the course, or of a place on it. */
export function address(root, path, anchor = '') {
  const encodedPath = path.split('/').map(encodeURIComponent).join('/')
  return root + encodedPath + (anchor ? `#${encodeURIComponent(anchor)}` : '')
}

/** The title of a page, with its number or its kind. */
export function pageTitle(page, strings) {
  const kind = strings[`kind_${page.kind}`] ?? strings.kind_page
  return [
    page.name ? h('span', { class: 'number' }, page.name) : null,
    page.name ? ' ' : null,
    ...markedText(page.title),
    page.kind === 'lesson' ? null : h('span', { class: 'found-kind' }, kind),
  ].filter((part) => part !== null)
}

/** A hit in a page: its headings, and an excerpt. */
export function hitParts({ trail, excerpt }) {
  const path = trail.flatMap((heading, index) => [
    ...(index > 0 ? [h('span', { class: 'found-step', 'aria-hidden': 'true' }, ' › ')] : []),
    ...markedText(heading),
  ])
  const hasExcerpt = excerpt && excerpt.parts.length > 0
  return [
    path.length > 0 ? h('span', { class: 'found-trail' }, ...path) : null,
    hasExcerpt ? h('span', { class: excerpt.code ? 'found-text found-code' : 'found-text' }, ...markedText(excerpt.parts)) : null,
  ].filter((part) => part !== null)
}

/** The number of results, in words. */
export function summary(result, strings) {
  if (result.count === 0) return fill(strings.none, { query: result.query })
  const count = say((key) => strings[key] ?? key, 'count', { n: result.count })
  const quoted = result.instead.map((word) => fill(strings.quoted, { word })).join(`${strings.comma} `)
  const instead = quoted ? fill(strings.instead, { words: quoted }) : ''
  return [`${count}.`, instead, result.complete ? '' : strings.part_failed].filter(Boolean).join(' ')
}
