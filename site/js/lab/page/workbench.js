/**
 * A lab of the kind `mjcf`: an instrument with the text of its model, which the reader edits and runs.
 *
 * The text is compiled in a dedicated worker, a new one each time, so that a model that never compiles, or takes all memory, can be
 * stopped.
 */

import { h, textButton } from './dom.js'
import { Editor } from './editor.js'
import { Instrument } from './instrument.js'
import { copyLink, writeLink } from './share.js'

/**
 * Let the reader edit the model of an instrument, in its place.
 *
 * @param {Instrument} instrument @param {string} xml the text of its model @param {() => void} leave the reader wants the lab again
 */
export function openEditor({ element, config, base, words }, xml, leave) {
  const bare = { goal: null, exportPython: null, source: null, key: null, start: null, still: '', stopAt: null, trail: null, autoplay: false }
  const own = { kind: 'mjcf', xml, mjb: '', module: '', worker: `${config.worker}#${config.id}` }
  const bench = new Workbench(element, { ...config, ...bare, ...own, controls: [], readouts: [], plots: [] }, base, words)
  bench.backButton.after(textButton(words('lab.live.leave'), leave))
  bench.editor.field.focus()
  return bench
}

export class Workbench extends Instrument {
  build() {
    super.build()
    const { words, config } = this
    this.otherText = config.xml // the reader's text, while the lesson's is in the editor
    this.editor = new Editor(config.xml, words, { run: () => this.run(), input: () => this.labelBackButton() })
    this.backButton = textButton('', () => this.exchange())
    const run = textButton(words('lab.live.compile'), () => this.run())
    const keys = h('span', {}, words('lab.live.keys_compile'))
    this.editor.element.append(h('div', { class: 'lab-buttons' }, run, this.backButton, keys))
    this.labelBackButton()
    this.body.prepend(this.editor.element)
  }

  listeners() {
    const inherited = super.listeners()
    return {
      ...inherited,
      ready: (message) => {
        this.editor.clear()
        inherited.ready(message)
      },
      error: (error) => {
        this.playRequested = false
        if (error.kind === 'load') this.editor.fail(error.message)
        else inherited.error(error)
      },
    }
  }

  /** Compile the text. */
  run(play = true) {
    this.notices.clear()
    this.editor.clear()
    this.playRequested = play
    this.simulation.load(this.editor.text)
  }

  /** Exchange the reader's text for the lesson's model, or back. */
  exchange() {
    const { editor, config } = this
    const text = editor.text
    editor.text = text === config.xml ? this.otherText : config.xml
    if (text !== config.xml) this.otherText = text
    this.labelBackButton()
    this.run()
  }

  labelBackButton() {
    const { editor, config, otherText, words } = this
    const showsLesson = editor.text !== config.xml || otherText === config.xml
    this.backButton.textContent = words(showsLesson ? 'lab.live.lesson_model' : 'lab.live.my_model')
  }

  shareAction() {
    return ['link_model', () => this.shareModel()]
  }

  async shareModel() {
    const { words, notices, config, editor } = this
    const state = { values: [], steps: 0, time: 0, physics: new Float64Array(), text: editor.text }
    const { link, only } = await writeLink(config.id, state)
    if (only === null) notices.show(words(await copyLink(link)), 'note')
    else notices.show(words('lab.live.link_long'), 'warning')
  }

  /** Show the model of a link. */
  restore({ text }) {
    if (text === undefined) return
    this.editor.text = text
    this.labelBackButton()
    this.run(false)
  }
}
