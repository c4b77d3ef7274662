/**
 * Marks in the page: at each mistake in its text, at each recorded output that is being checked or has changed, at each figure that
 * has changed, and at each bound number that does not hold.
 *
 *   const marks = new Marks(say, accept)      say(key, values) → text; accept(id) → Promise<text>: why not, or nothing
 *   marks.show(news)                          after each piece of news, and after each change of the page
 */

import { h } from '../lab/page/dom.js'
import { unfold } from '../page/unfold.js'
import { formatCode, offerButton, OF_THE_TOOL, verdict } from './elements.js'
import { timesOf } from './times.js'

const SIGNS = { ' ': '\u2007', '-': '−', '+': '+' }
const KINDS = { ' ': 'both', '-': 'gone', '+': 'come' }
const STATES = ['running', 'failed', 'timeout', 'killed', 'output-limit', 'encoding']

export class Marks {
  constructor(say, accept) {
    this.say = say
    this.accept = accept
    this.marksByElement = new Map() // element → { text, parts }
  }

  show({ problems, outputs, figures, numbers, running }) {
    this.running = running
    const itemsByElement = new Map()
    for (const { mark, severity, message, help } of problems) {
      const element = mark && document.getElementById(mark)
      if (!element) continue
      const { mistakes } = itemsByElement.get(element) ?? { mistakes: [] }
      itemsByElement.set(element, { mistakes: [...mistakes, { severity, message, help }] })
    }
    for (const output of outputs) {
      const element = outputOf(output)
      if (element && (output.state === 'drift' || STATES.includes(output.state))) itemsByElement.set(element, output)
    }
    for (const figure of figures) {
      const element = figureOf(figure)
      if (element) itemsByElement.set(element, figure)
    }
    for (const number of numbers) {
      const element = numberOf(number)
      if (element) itemsByElement.set(element, number)
    }
    for (const [element, { parts }] of this.marksByElement) {
      if (itemsByElement.has(element) && element.isConnected) continue
      clear(element, parts)
      this.marksByElement.delete(element)
    }
    for (const [element, item] of itemsByElement) this.mark(element, item)
  }

  mark(element, item) {
    const text = JSON.stringify(item)
    const old = this.marksByElement.get(element)
    if (old?.text === text) return
    if (old) clear(element, old.parts)
    this.marksByElement.set(element, { text, parts: this.makeParts(element, item) })
  }

  makeParts(element, item) {
    if ('mistakes' in item) return this.markMistakes(element, item)
    if ('rows' in item) return this.markOutput(element, item)
    if ('drawn' in item) return item.drawn ? this.markFigure(element, item) : this.markData(element, item)
    return 'state' in item ? this.markState(element, item) : this.markNumber(element, item)
  }

  /** What is wrong in the block below; without elements of blocks, as it may stand in a line. */
  markMistakes(element, { mistakes }) {
    const notes = mistakes.map(({ severity, message, help }) => {
      const note = h('span', { class: `preview-mistake preview-${severity}`, role: 'note', tabIndex: -1 }, ...verdict(this.say, severity, message))
      if (help) note.append(h('span', { class: 'preview-help', ...OF_THE_TOOL }, ...formatCode(help)))
      return note
    })
    element.append(...notes)
    return notes
  }

  markState(element, { state, script }) {
    const mark = h('p', { class: `preview-mark preview-${state === 'running' ? 'running' : 'failed'}`, role: 'status' }, this.say(`state.${state}`))
    const time = h('span', { class: 'preview-time', 'aria-hidden': 'true' }) // it changes each second
    if (state === 'running') mark.append(' ', time)
    const tell = () => {
      if (!mark.isConnected) return clearInterval(timer)
      const times = this.running.filter(({ path }) => path === script).map(timesOf)[0]
      time.textContent = times ? this.say(times.left ? 'time.left' : 'time.over', times) : ''
    }
    element.classList.add('preview-known')
    element.append(mark)
    const timer = state === 'running' ? setInterval(tell, 1000) : null
    tell()
    return [mark]
  }

  markOutput(element, run) {
    const signs = [sign('-'), ` ${this.say('output.recorded')} `, sign('+'), ` ${this.say('output.run')}`]
    const legend = h('p', { class: 'preview-legend' }, `${this.say('output.differs')} `, ...signs)
    const box = this.makeBox('output', legend, diff(run.rows), this.makeFoot(run, 'output'))
    element.classList.add('preview-known', 'preview-drifted')
    element.append(box)
    return [box]
  }

  markFigure(element, figure) {
    const image = element.querySelector('img')
    const drawings = [
      [this.say('output.recorded'), bypassCache(image.src)],
      [this.say('output.run'), figure.drawn],
    ].map(([label, src]) => h('div', { class: 'preview-drawing' }, h('img', { src, alt: `${image.alt} (${label})` }), h('p', {}, label)))
    const legend = h('p', { class: 'preview-legend' }, this.say('figure.differs', { reason: figure.differs }))
    const box = this.makeBox('figure', legend, h('div', { class: 'preview-drawings' }, ...drawings), this.makeFoot(figure, 'figure'))
    element.classList.add('preview-drifted')
    element.prepend(box)
    return [box]
  }

  markData(element, figure) {
    const legend = h('p', { class: 'preview-legend' }, this.say('data.differs', { reason: figure.differs }))
    const box = this.makeBox('data', legend, this.makeFoot(figure, 'data'))
    element.append(box)
    return [box]
  }

  markNumber(element, number) {
    const box = h('span', { class: 'preview-number', role: 'group', 'aria-label': this.say('number.label') })
    const better = number.better ? [h('ins', { class: 'preview-better' }, number.better), ' '] : []
    box.append(' ', ...better, h('span', { class: 'preview-why' }, number.label || number.message), ' ', this.makeFoot(number, 'number'))
    element.classList.add('preview-wrong')
    element.after(box)
    return [box]
  }

  makeBox(kind, ...parts) {
    return h('div', { class: 'preview-drift', role: 'group', 'aria-label': this.say(`${kind}.label`) }, ...parts)
  }

  /** The button that accepts a change, or the reason why there is none. */
  makeFoot({ offer, refused }, kind) {
    const reason = refused ? [h('span', { class: 'preview-why' }, this.say('refused', { reason: refused }))] : []
    return h('span', { class: 'preview-foot' }, ...(offer ? offerButton(this.say(`${kind}.accept`), this.say, () => this.accept(offer)) : reason))
  }
}

/** Bring the mark of a mistake into view, out of folds, and give it the focus. */
export function showMistake(mark) {
  const element = document.getElementById(mark)
  if (!element) return
  unfold(element)
  element.scrollIntoView({ block: 'center' })
  element.querySelector('.preview-mistake')?.focus({ preventScroll: true })
}

function sign(mark) {
  return h('span', { class: `preview-sign preview-${KINDS[mark]}` }, SIGNS[mark])
}

/** The lines of a recorded output and of this run, distinguished by a sign and, for screen readers, by their element. */
function diff(rows) {
  const list = h('pre', { class: 'preview-diff', tabIndex: 0 })
  for (const [mark, pieces] of rows) {
    const line = h({ ' ': 'span', '-': 'del', '+': 'ins' }[mark], { class: 'preview-text' })
    for (const [text, isChanged] of pieces) line.append(isChanged && mark !== ' ' ? h('mark', {}, text) : text)
    list.append(h('span', { class: `preview-row preview-${KINDS[mark]}` }, h('span', { class: 'preview-sign' }, SIGNS[mark]), line), '\n')
  }
  return list
}

function clear(element, parts) {
  for (const part of parts) part.remove()
  for (const image of element.querySelectorAll(':scope > img')) image.src = bypassCache(image.src)
  element.classList.remove('preview-known', 'preview-drifted', 'preview-wrong')
}

/** The `nth` recorded output of a script on the page. */
function outputOf({ script, nth }) {
  const belongs = (figure) => figure.dataset.script === script
  const figures = [...document.querySelectorAll('figure[data-script]')].filter(belongs)
  return figures.flatMap((figure) => [...figure.querySelectorAll('.output')])[nth] ?? null
}

/** The figure whose drawing has this name, or the caption of the figure whose data have it. */
function figureOf({ name, drawn: isDrawing }) {
  const stem = isDrawing ? name : name.replace(/csv$/, '')
  const figures = [...document.querySelectorAll('figure[data-figure]')]
  const figure = figures.find(({ dataset }) => (isDrawing ? dataset.figure === stem : dataset.figure.startsWith(stem)))
  return (isDrawing ? figure : figure?.querySelector('figcaption')) ?? null
}

/** An address that makes a browser load an image again. */
function bypassCache(src) {
  const url = new URL(src)
  url.searchParams.set('at', String(Date.now()))
  return url.href
}

/** The `nth` bound number with this text. The page shows minus signs where the lesson has hyphens. */
function numberOf({ text, nth }) {
  const plain = (label) => label.replaceAll('\u2212', '-')
  return [...document.querySelectorAll('.prose .bound')].filter((element) => plain(element.textContent) === plain(text))[nth] ?? null
}
