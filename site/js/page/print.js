/**
 * Prepares for print: sets the running title, puts the answers of questions behind the text, and opens folds for browsers in which
 * style sheets cannot. A further section that is closed is not printed, nor is a folded listing of more than sixty lines.
 */

import { h } from '../lab/page/dom.js'

/** A text as a string of CSS. */
function cssString(text) {
  return `"${text.replaceAll(/["\\]/g, '\\$&').replaceAll(/[\n\r\f\0]/g, ' ')}"`
}

export function openForPrint(window) {
  const { document } = window
  let openedFolds = []
  let putBack = () => {}
  window.addEventListener('beforeprint', () => {
    document.documentElement.style.setProperty('--running-title', cssString(document.title))
    openedFolds = [...document.querySelectorAll('details:not([open], .further-text, .fold:has([id]:nth-child(61)))')]
    for (const details of openedFolds) details.open = true
    putBack = moveAnswers(document)
  })
  window.addEventListener('afterprint', () => {
    putBack()
    for (const details of openedFolds) details.open = false
  })
}

/** Move the answers of all questions that are printed to a section behind the text. @returns {() => void} puts them back */
function moveAnswers(document) {
  const text = document.querySelector('.columns > .prose')
  const section = h('section', { class: 'answers' })
  const places = []
  for (const quiz of text?.querySelectorAll('.quiz') ?? []) {
    const answers = [...quiz.querySelectorAll('.question > .answer:not(.is-empty)')]
    if (answers.length === 0 || quiz.closest('.further-text:not([open])') !== null) continue
    const items = answers.map((answer) => {
      const { number } = answer.closest('.question').dataset
      const mark = document.createComment('')
      answer.replaceWith(mark)
      places.push([mark, answer])
      return h('li', { value: Number(number) }, answer)
    })
    section.append(h('p', { class: 'quiz-title' }, quiz.getAttribute('aria-label')), h('ol', {}, ...items))
  }
  if (places.length > 0) text.after(section)
  return () => {
    for (const [mark, answer] of places) mark.replaceWith(answer)
    section.remove()
  }
}
