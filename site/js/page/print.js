/**
 * Prepares for print: sets the running title, and puts answers and solutions behind the text. (Style sheets open the folds.) A further
 * section that is closed is not printed.
 */

import { h } from '../lab/page/dom.js'

/** A text as a string of CSS. */
function cssString(text) {
  return `"${text.replaceAll(/["\\]/g, '\\$&').replaceAll(/[\n\r\f\0]/g, ' ')}"`
}

export function prepareForPrint(window) {
  const { document } = window
  let putBack = () => {}
  window.addEventListener('beforeprint', () => {
    document.documentElement.style.setProperty('--running-title', cssString(document.title))
    putBack = moveAnswers(document)
  })
  window.addEventListener('afterprint', () => putBack())
}

/** Move what answers questions, exercises and tasks, where it is printed, to a list behind the text. @returns {() => void} puts it back */
function moveAnswers(document) {
  const text = document.querySelector('.columns > .prose')
  const list = h('ol', { class: 'answers' })
  text?.after(list)
  const add = (content) => {
    const item = h('li', {}, content)
    list.append(item)
    return item
  }
  const places = []
  let last
  for (const answer of text?.querySelectorAll('.answer:not(.is-empty), .callout-solution') ?? []) {
    if (answer.closest('.further-text:not([open])')) continue
    const asked = answer.closest('.quiz, .exercise')
    if (asked && asked !== last) add(asked.ariaLabel).className = 'quiz-title'
    last = asked
    const number = answer.closest('.question')?.dataset.number
    const mark = document.createComment('')
    answer.replaceWith(mark)
    const item = add(answer)
    if (number) item.value = number
    places.push([mark, answer])
  }
  return () => {
    for (const [mark, answer] of places) mark.replaceWith(answer)
    list.remove()
  }
}
