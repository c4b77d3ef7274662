/**
 * Marks in the page for the results of scripts: at each recorded output that is being checked or has changed, at each figure that
 * has changed, and at each bound number that does not hold.
 *
 *   const marks = new Marks(accept)      accept(id) → Promise<text>: why not, or nothing
 *   marks.show(news)                     after each piece of news, and after each change of the page
 */

import { h } from './elements.js'

const SIGNS = { ' ': '\u2007', '-': '−', '+': '+' }
const KINDS = { ' ': 'both', '-': 'gone', '+': 'come' }
const STATES = {
  running: 'The script is running.',
  failed: 'The script failed.',
  timeout: 'The script took too long.',
  killed: 'The script was ended.',
  'output-limit': 'The script printed too much.',
  encoding: 'The script printed what is no text.',
}

export class Marks {
  constructor(accept) {
    this.accept = accept
    this.marksByElement = new Map() // element → { text, parts }
  }

  show({ outputs, figures, numbers }) {
    const itemsByElement = new Map()
    for (const output of outputs) {
      const element = outputOf(output)
      if (element && (output.state === 'drift' || output.state in STATES)) itemsByElement.set(element, output)
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
    if ('rows' in item) return this.markOutput(element, item)
    if ('drawn' in item) return item.drawn ? this.markFigure(element, item) : this.markData(element, item)
    return 'state' in item ? this.markState(element, item) : this.markNumber(element, item)
  }

  markState(element, { state }) {
    const mark = h('p', { class: `preview-mark preview-${state === 'running' ? 'running' : 'failed'}`, role: 'status' }, STATES[state])
    element.classList.add('preview-known')
    element.append(mark)
    return [mark]
  }

  markOutput(element, run) {
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded output, and this run' })
    box.append(
      h('p', { class: 'preview-legend' }, 'The script prints something else now: ', sign('-'), ' recorded, ', sign('+'), ' this run.'),
      diff(run.rows),
      this.makeFoot(run, 'Accept this output', 'It is run once more, to see whether it prints the same again.'),
    )
    element.classList.add('preview-known', 'preview-drifted')
    element.append(box)
    return [box]
  }

  markFigure(element, figure) {
    const image = element.querySelector('img')
    const drawings = [
      ['recorded', bypassCache(image.src)],
      ['this run', figure.drawn],
    ].map(([label, src]) => h('div', { class: 'preview-drawing' }, h('img', { src, alt: `${image.alt} (${label})` }), h('p', {}, label)))
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded figure, and this run' })
    box.append(
      h('p', { class: 'preview-legend' }, `The script draws something else now: ${figure.differs}.`),
      h('div', { class: 'preview-drawings' }, ...drawings),
      this.makeFoot(figure, 'Accept this figure', ''),
    )
    element.classList.add('preview-drifted')
    element.prepend(box)
    return [box]
  }

  markData(element, figure) {
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded data, and this run' })
    box.append(h('p', { class: 'preview-legend' }, `The script writes other data now: ${figure.differs}.`), this.makeFoot(figure, 'Accept these data', ''))
    element.append(box)
    return [box]
  }

  markNumber(element, number) {
    const box = h('span', { class: 'preview-number', role: 'group', 'aria-label': 'A bound number that does not hold' })
    const better = number.better ? [h('ins', { class: 'preview-better' }, number.better), ' '] : []
    box.append(' ', ...better, h('span', { class: 'preview-why' }, number.label || number.message), ' ', this.makeFoot(number, 'Accept', ''))
    element.classList.add('preview-wrong')
    element.after(box)
    return [box]
  }

  /** The button that accepts a change, or the reason why there is none. */
  makeFoot({ offer, refused }, label, note) {
    const foot = h('span', { class: 'preview-foot' })
    if (!offer) {
      const text = refused ? `It cannot be accepted: ${refused}.` : note
      if (text) foot.append(h('span', { class: 'preview-why' }, text))
      return foot
    }
    const answer = h('span', { class: 'preview-why', role: 'status' })
    const button = h('button', { type: 'button', class: 'preview-accept' }, label)
    button.addEventListener('click', async () => {
      button.disabled = true
      answer.textContent = 'Written.'
      const refusal = await this.accept(offer)
      if (!refusal) return
      answer.textContent = `Nothing was written: ${refusal}.`
      button.disabled = false
    })
    foot.append(button, answer)
    return foot
  }
}

function sign(mark) {
  return h('span', { class: `preview-sign preview-${KINDS[mark]}` }, SIGNS[mark])
}

/** The lines of a recorded output and of this run, distinguished by a sign and, for screen readers, by their element. */
function diff(rows) {
  const list = h('pre', { class: 'preview-diff', tabindex: '0' })
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
  url.searchParams.set('at', Date.now())
  return url.href
}

/** The `nth` bound number with this text. The page shows minus signs where the lesson has hyphens. */
function numberOf({ text, nth }) {
  const plain = (label) => label.replaceAll('\u2212', '-')
  return [...document.querySelectorAll('.prose .bound')].filter((element) => plain(element.textContent) === plain(text))[nth] ?? null
}
