/**
 * Predictions come before their answers: the text after a quiz up to the next heading or rule, except for the next lab, is hidden
 * until all questions of the quiz with `data-gate` are answered. The browser's search still finds it, and a link into it opens it.
 *
 * A question with `data-run` runs that lab once it is answered.
 */

import { h } from '../lab/page/dom.js'
import { linkedLab } from './labs.js'
import { decode } from './unfold.js'

const FLOW = '.prose > :not(.dock), .dock > * > *'
const END = 'h2, h3, h4, h5, h6, hr, .further, .footnotes'

const openers = new Map() // id of a quiz → function that opens its text
const openedQuizzes = new Set() // ids of the quizzes whose text was opened on this page

/** The blocks after a quiz, up to the next heading or rule. */
function blocksBelow(quiz) {
  const flow = [...document.querySelectorAll(FLOW)]
  const start = flow.indexOf(quiz) + 1
  const end = flow.findIndex((block, index) => index >= start && block.matches(END))
  return start === 0 ? [] : flow.slice(start, end < 0 ? undefined : end)
}

const nextLab = (blocks) => blocks.find((block) => block.matches('[data-lab]:not([data-exercise])'))

function isAnswered(quiz, progress) {
  return [...quiz.querySelectorAll('[data-gate]')].every(({ dataset }) => progress.get(quiz.dataset.quiz, dataset.question))
}

/** Hide the text after unanswered predictions; called again when the page has changed. */
export function gatePredictions(document, words, progress) {
  document.querySelectorAll('.gate').forEach((gate) => gate.remove())
  const target = document.getElementById(linkedLab(location.hash) ?? decode(location.hash.slice(1)))
  for (const quiz of document.querySelectorAll('[data-quiz]:has([data-gate])')) {
    const blocks = blocksBelow(quiz)
    const lab = nextLab(blocks)
    const text = blocks.filter((block) => block !== lab)
    const open = isAnswered(quiz, progress) || openedQuizzes.has(quiz.dataset.quiz) || text.some((block) => block.contains(target))
    if (!open) close(quiz.dataset.quiz, text, words)
  }
}

function close(id, text, words) {
  const open = () => {
    openedQuizzes.add(id)
    gate.remove()
    for (const block of text) block.hidden = false
  }
  const openAndFocus = () => {
    open()
    text[0].tabIndex = -1 // it takes the place, and the focus, of the button
    text[0].focus()
  }
  const button = h('button', { type: 'button', class: 'quiet', onclick: openAndFocus }, words('quiz.live.open'))
  const gate = h('p', { class: 'gate' }, `${words('quiz.live.gate')} `, button)
  openers.set(id, open)
  text[0]?.before(gate)
  for (const block of text) {
    block.hidden = 'until-found'
    block.addEventListener('beforematch', open, { once: true })
  }
}

/** Open the text when its questions are answered, and run the lab in the way that the question was about. */
export function followPredictions(document, progress) {
  document.addEventListener('coursebuild:answered', ({ target }) => {
    const quiz = target.closest('[data-quiz]')
    if (quiz === null) return // an exercise
    if (isAnswered(quiz, progress)) openers.get(quiz.dataset.quiz)?.()
    if (!('run' in target.dataset)) return
    const detail = [JSON.parse(target.dataset.run)].flat()
    nextLab(blocksBelow(quiz))?.dispatchEvent(new CustomEvent('coursebuild:run', { detail }))
  })
}
