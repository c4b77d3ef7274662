/**
 * A lab of the kind `mjcf`: an instrument, and the text of its model, which the reader edits and runs.
 *
 * The text is compiled in a worker of the lab's own, a new one each time: a model that never compiles, or takes all memory, ends with it.
 */

import { h } from './dom.js'
import { Editor } from './editor.js'
import { Instrument } from './instrument.js'
import { writeLink } from './share.js'

export class Workbench extends Instrument {
  build() {
    super.build()
    const { words, config } = this
    this.other = config.xml // what the second button puts in the place of the text
    this.editor = new Editor(config.xml, words, { run: () => this.run(), input: () => this.rename() })
    this.back = h('button', { type: 'button', class: 'lab-button', onclick: () => this.exchange() })
    const run = h('button', { type: 'button', class: 'lab-button', onclick: () => this.run() }, words('lab.live.compile'))
    const keys = h('span', {}, words('lab.live.keys_compile'))
    this.editor.element.append(h('div', { class: 'lab-buttons' }, run, this.back, keys))
    this.rename()
    this.body.prepend(this.editor.element)
  }

  listeners() {
    const on = super.listeners()
    return {
      ...on,
      ready: (message) => {
        this.editor.clear()
        on.ready(message)
      },
      error: (error) => {
        this.pressed = false
        if (error.kind === 'load') this.editor.fail(error.message)
        else on.error(error)
      },
    }
  }

  /** Compile the text. */
  run(play = true) {
    this.notices.clear()
    this.editor.clear()
    this.pressed = play
    this.simulation.load(this.editor.text)
  }

  /** Put the lesson's model in the place of the reader's, or that back. */
  exchange() {
    const { editor, config } = this
    const now = editor.text
    editor.text = now === config.xml ? this.other : config.xml
    if (now !== config.xml) this.other = now
    this.rename()
    this.run()
  }

  rename() {
    const { editor, config, other, words } = this
    const back = editor.text !== config.xml || other === config.xml
    this.back.textContent = words(back ? 'lab.live.lesson_model' : 'lab.live.my_model')
  }

  sharing() {
    return ['link_model', () => this.shareModel()]
  }

  async shareModel() {
    const { words, notices, config, editor } = this
    const state = { values: [], steps: 0, time: 0, physics: new Float64Array(), text: editor.text }
    const { link, only } = await writeLink(config.id, state)
    if (only === null) notices.show(words(await this.copy(link)), 'note')
    else notices.show(words('lab.live.link_long'), 'warning')
  }

  /** Show a model of a link. */
  restore({ text }) {
    if (text === undefined) return
    this.editor.text = text
    this.rename()
    this.run(false)
  }
}
