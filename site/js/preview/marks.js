/**
 * How scripts did, in its place: beside each recorded output that is still checked, or that is another now, at each figure that is
 * another now, and at each bound number that does not hold.
 *
 *   const marks = new Marks(accept)      accept(id) → Promise<text>, why not, or nothing
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
    this.shown = new Map() // element → { text, parts }
  }

  show({ outputs, figures, numbers }) {
    const wanted = new Map()
    for (const told of outputs) {
      const element = outputOf(told)
      if (element && (told.state === 'drift' || told.state in STATES)) wanted.set(element, told)
    }
    for (const told of figures) {
      const element = figureOf(told)
      if (element) wanted.set(element, told)
    }
    for (const told of numbers) {
      const element = numberOf(told)
      if (element) wanted.set(element, told)
    }
    for (const [element, { parts }] of this.shown) {
      if (wanted.has(element) && element.isConnected) continue
      clear(element, parts)
      this.shown.delete(element)
    }
    for (const [element, told] of wanted) this.mark(element, told)
  }

  mark(element, told) {
    const text = JSON.stringify(told)
    const old = this.shown.get(element)
    if (old?.text === text) return
    if (old) clear(element, old.parts)
    this.shown.set(element, { text, parts: this.parts(element, told) })
  }

  parts(element, told) {
    if ('rows' in told) return this.drift(element, told)
    if ('drawn' in told) return told.drawn ? this.figure(element, told) : this.data(element, told)
    return 'state' in told ? this.state(element, told) : this.number(element, told)
  }

  state(element, { state }) {
    const mark = h('p', { class: `preview-mark preview-${state === 'running' ? 'running' : 'failed'}`, role: 'status' }, STATES[state])
    element.classList.add('preview-known')
    element.append(mark)
    return [mark]
  }

  drift(element, told) {
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded output, and this run' })
    box.append(
      h('p', { class: 'preview-legend' }, 'The script prints something else now: ', sign('-'), ' recorded, ', sign('+'), ' this run.'),
      diff(told.rows),
      this.foot(told, 'Accept this output', 'It is run once more, to see whether it prints the same again.'),
    )
    element.classList.add('preview-known', 'preview-drifted')
    element.append(box)
    return [box]
  }

  figure(element, told) {
    const image = element.querySelector('img')
    const drawings = [
      ['recorded', reloaded(image.src)],
      ['this run', told.drawn],
    ].map(([label, src]) => h('div', { class: 'preview-drawing' }, h('img', { src, alt: `${image.alt} (${label})` }), h('p', {}, label)))
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded figure, and this run' })
    box.append(
      h('p', { class: 'preview-legend' }, `The script draws something else now: ${told.differs}.`),
      h('div', { class: 'preview-drawings' }, ...drawings),
      this.foot(told, 'Accept this figure', ''),
    )
    element.classList.add('preview-drifted')
    element.prepend(box)
    return [box]
  }

  data(element, told) {
    const box = h('div', { class: 'preview-drift', role: 'group', 'aria-label': 'Recorded data, and this run' })
    box.append(h('p', { class: 'preview-legend' }, `The script writes other data now: ${told.differs}.`), this.foot(told, 'Accept these data', ''))
    element.append(box)
    return [box]
  }

  number(element, told) {
    const box = h('span', { class: 'preview-number', role: 'group', 'aria-label': 'A bound number that does not hold' })
    const better = told.better ? [h('ins', { class: 'preview-better' }, told.better), ' '] : []
    box.append(' ', ...better, h('span', { class: 'preview-why' }, told.label || told.message), ' ', this.foot(told, 'Accept', ''))
    element.classList.add('preview-wrong')
    element.after(box)
    return [box]
  }

  /** The button that accepts, or why there is none. */
  foot({ offer, refused }, label, waiting) {
    const foot = h('span', { class: 'preview-foot' })
    if (!offer) {
      const text = refused ? `It cannot be accepted: ${refused}.` : waiting
      if (text) foot.append(h('span', { class: 'preview-why' }, text))
      return foot
    }
    const answer = h('span', { class: 'preview-why', role: 'status' })
    const button = h('button', { type: 'button', class: 'preview-accept' }, label)
    button.addEventListener('click', async () => {
      button.disabled = true
      answer.textContent = 'Written.'
      const why = await this.accept(offer)
      if (!why) return
      answer.textContent = `Nothing was written: ${why}.`
      button.disabled = false
    })
    foot.append(button, answer)
    return foot
  }
}

function sign(mark) {
  return h('span', { class: `preview-sign preview-${KINDS[mark]}` }, SIGNS[mark])
}

/** The lines of a recorded output and of what ran. A sign tells them apart, and for whoever hears the page an element. */
function diff(rows) {
  const list = h('pre', { class: 'preview-diff', tabindex: '0' })
  for (const [mark, pieces] of rows) {
    const line = h({ ' ': 'span', '-': 'del', '+': 'ins' }[mark], { class: 'preview-text' })
    for (const [text, changed] of pieces) line.append(changed && mark !== ' ' ? h('mark', {}, text) : text)
    list.append(h('span', { class: `preview-row preview-${KINDS[mark]}` }, h('span', { class: 'preview-sign' }, SIGNS[mark]), line), '\n')
  }
  return list
}

function clear(element, parts) {
  for (const part of parts) part.remove()
  for (const image of element.querySelectorAll(':scope > img')) image.src = reloaded(image.src)
  element.classList.remove('preview-known', 'preview-drifted', 'preview-wrong')
}

/** The recorded output of a script with this number among its outputs on the page. */
function outputOf({ script, nth }) {
  const own = (figure) => figure.dataset.script === script
  const figures = [...document.querySelectorAll('figure[data-script]')].filter(own)
  return figures.flatMap((figure) => [...figure.querySelectorAll('.output')])[nth] ?? null
}

/** The figure that shows a drawing with this name, or the caption of the one whose data have it. */
function figureOf({ name, drawn }) {
  const known = drawn ? name : name.replace(/csv$/, '')
  const figures = [...document.querySelectorAll('figure[data-figure]')]
  const figure = figures.find(({ dataset }) => (drawn ? dataset.figure === known : dataset.figure.startsWith(known)))
  return (drawn ? figure : figure?.querySelector('figcaption')) ?? null
}

/** An address by which a browser asks for an image that it has already. */
function reloaded(src) {
  const url = new URL(src)
  url.searchParams.set('at', Date.now())
  return url.href
}

/** The bound number with this place among those of the same text. The page shows minus signs where the lesson has hyphens. */
function numberOf({ text, nth }) {
  const plain = (shown) => shown.replaceAll('\u2212', '-')
  return [...document.querySelectorAll('.prose .bound')].filter((bound) => plain(bound.textContent) === plain(text))[nth] ?? null
}
