/**
 * Predictions before what answers them: the text after a quiz, up to the next heading or rule, is hidden until all questions of the
 * quiz with `data-gate` are answered, but for the next lab. A search of the page finds it all the same, and a link into it opens it.
 *
 * A question with `data-run` runs that lab once it is answered.
 */

import { h } from '../lab/page/dom.js'
import { linkedLab } from './labs.js'
import { decoded } from './unfold.js'

const FLOW = '.prose > :not(.dock), .dock > * > *'
const END = 'h2, h3, h4, h5, h6, hr, .further, .footnotes'

const closed = new Map() // id of a quiz → what opens its text
const opened = new Set() // ids of those that were opened on this page

/** What follows a quiz, up to the next heading or rule. */
function blocksBelow(quiz) {
  const flow = [...document.querySelectorAll(FLOW)]
  const start = flow.indexOf(quiz) + 1
  const end = flow.findIndex((block, at) => at >= start && block.matches(END))
  return start === 0 ? [] : flow.slice(start, end < 0 ? undefined : end)
}

const nextLab = (blocks) => blocks.find((block) => block.matches('[data-lab]'))

function isAnswered(quiz, progress) {
  return [...quiz.querySelectorAll('[data-gate]')].every(({ dataset }) => progress.get(quiz.dataset.quiz, dataset.question))
}

/** Hide what is not to be seen yet; called again when the page has changed. */
export function gatePredictions(document, words, progress) {
  document.querySelectorAll('.gate').forEach((gate) => gate.remove())
  const linked = document.getElementById(linkedLab(location.hash) ?? decoded(location.hash.slice(1)))
  for (const quiz of document.querySelectorAll('[data-quiz]:has([data-gate])')) {
    const blocks = blocksBelow(quiz)
    const lab = nextLab(blocks)
    const text = blocks.filter((block) => block !== lab)
    const open = isAnswered(quiz, progress) || opened.has(quiz.dataset.quiz) || text.some((block) => block.contains(linked))
    if (!open) close(quiz.dataset.quiz, text, words)
  }
}

function close(id, text, words) {
  const open = () => {
    opened.add(id)
    gate.remove()
    for (const block of text) block.hidden = false
  }
  const read = () => {
    open()
    text[0].tabIndex = -1 // where the button was
    text[0].focus()
  }
  const button = h('button', { type: 'button', class: 'quiet', onclick: read }, words('quiz.live.open'))
  const gate = h('p', { class: 'gate' }, `${words('quiz.live.gate')} `, button)
  closed.set(id, open)
  text[0]?.before(gate)
  for (const block of text) {
    block.hidden = 'until-found'
    block.addEventListener('beforematch', open, { once: true })
  }
}

/** Open the text when its questions are answered, and run the lab as it was asked about. */
export function followPredictions(document, progress) {
  document.addEventListener('coursebuild:answered', ({ target }) => {
    const quiz = target.closest('[data-quiz]')
    if (isAnswered(quiz, progress)) closed.get(quiz.dataset.quiz)?.()
    if (!('run' in target.dataset)) return
    const detail = [JSON.parse(target.dataset.run)].flat()
    nextLab(blocksBelow(quiz))?.dispatchEvent(new CustomEvent('coursebuild:run', { detail }))
  })
}
