/**
 * A lab of the kind `mjcf`: an instrument with the text of its model, which the reader edits and runs.
 *
 * The text is compiled in a dedicated worker, a new one each time, so that a model that never compiles, or takes all memory, can be
 * stopped.
 */

import { buildControls } from './controls.js'
import { h, textButton } from './dom.js'
import { Editor } from './editor.js'
import { FilesError, MOST_BYTES, readModels } from './files.js'
import { Instrument } from './instrument.js'
import { LONGEST_MODEL } from './share.js'

/**
 * Let the reader edit the model of an instrument, in its place.
 *
 * @param {Instrument} instrument @param {string} xml the text of its model @param {() => void} leave the reader wants the lab again
 */
export function openEditor({ element, config, base, words }, xml, leave) {
  const bare = { goal: null, exportPython: null, source: null, key: null, start: null, still: '', stopAt: null, trail: null, autoplay: false }
  const own = { kind: 'mjcf', xml, mjb: '', module: '', worker: `${config.worker}#${config.id}` }
  const bench = new Workbench(element, { ...config, ...bare, ...own, controls: [], readouts: [], plots: [] }, base, words)
  bench.editor.backButton.after(textButton(words('lab.live.leave'), leave))
  bench.editor.field.focus()
  return bench
}

export class Workbench extends Instrument {
  build() {
    super.build()
    const { words, config } = this
    this.own = null // the files beside the reader's model
    this.isOther = false // whether that began as another than the lab's
    const texts = {
      label: words('lab.live.model'),
      run: words('lab.live.compile'),
      keys: words('lab.live.keys_compile'),
      back: words('lab.live.lesson_model'),
      mine: words('lab.live.my_model'),
    }
    this.editor = new Editor(config.xml, words, texts, { run: () => this.run(), exchange: () => this.run() })
    this.editor.element.append(this.makeSources())
    this.body.prepend(this.editor.element)
  }

  /** Where a model comes from beside the keyboard: those that the author offers, and files of the reader's device. */
  makeSources() {
    const { words, config, body } = this
    const options = [[config.title, ''], ...(config.starts ?? []).map(({ name, source }) => [name, source])]
    const start = (_, source) => this.startFrom(source)
    this.starts = buildControls([{ type: 'select', label: words('lab.live.start_from'), options }], { set: start })
    const picker = h('input', { type: 'file', multiple: true, hidden: true })
    picker.addEventListener('change', async () => {
      await this.openFiles(picker.files)
      picker.value = '' // the same file may be taken again
    })
    body.addEventListener('dragover', (event) => {
      if (event.dataTransfer.types.includes('Files')) event.preventDefault()
    })
    body.addEventListener('drop', (event) => {
      if (event.dataTransfer.files.length === 0) return
      event.preventDefault()
      this.openFiles(event.dataTransfer.files)
    })
    const button = textButton(words('lab.live.open_file'), () => picker.click())
    const files = h('div', { class: 'lab-buttons' }, button, picker, h('span', {}, words('lab.live.open_note')))
    this.opened = h('div', { hidden: true }) // which of them is shown, and the others
    return h('div', { class: 'lab-sources' }, options.length > 1 ? this.starts.element : null, files, this.opened)
  }

  onReady(message) {
    this.editor.clear()
    super.onReady(message)
  }

  /** Compile the text. */
  run(play = true) {
    this.notices.clear()
    this.editor.clear()
    this.playRequested = play
    const { text } = this.editor
    const isLessons = text === this.config.xml
    this.opened.hidden = isLessons || this.own === null
    this.simulation.load(text, isLessons ? null : this.own, this.isOther && !isLessons)
  }

  /** Put another model into the editor, with the files beside it, and run it. */
  openModel(text, own = null) {
    this.own = own
    this.isOther = text !== this.config.xml
    this.editor.text = text
    this.run()
  }

  /** Begin with a model that the author offers. @param {string} source its address; empty for the lesson's own */
  async startFrom(source) {
    if (source === '') return this.openModel(this.config.xml)
    try {
      this.openModel(await this.fetchText(source))
    } catch (error) {
      this.editor.fail(error.message)
    }
  }

  /** Open files of the reader's device, with the likeliest of their models. @param {Iterable<File>} list */
  async openFiles(list) {
    const { words, editor, opened } = this
    try {
      const { models, files } = await readModels(list)
      const said = h('p', { role: 'status' })
      const open = (main) => {
        said.textContent = words('lab.live.opened', { name: main, n: files.size - 1 })
        this.openModel(models.get(main), { main, files })
      }
      const options = [...models.keys()].map((path) => [path, path])
      const menu = buildControls([{ type: 'select', label: words('lab.live.models'), options }], { set: (_, path) => open(path) })
      opened.replaceChildren(said, ...(options.length > 1 ? [menu.element] : []))
      open(options[0][0])
      this.starts.show([null]) // none of them
    } catch (error) {
      const limits = { most: MOST_BYTES >> 20, letters: LONGEST_MODEL }
      editor.fail(error instanceof FilesError ? words(`lab.live.${error.key}`, limits) : error.message)
    }
  }

  shareAction() {
    const state = { values: [], steps: 0, time: 0, physics: new Float64Array() }
    return ['link_model', () => this.share({ ...state, text: this.editor.text, isOther: this.isOther }, this.own?.files.size > 1 ? 'files' : '')]
  }

  /** Show the model of a link. */
  restore({ text, isOther }) {
    if (text === undefined) return
    this.own = null
    this.isOther = isOther
    if (isOther) this.starts.show([null])
    this.editor.text = text
    this.run(false)
  }
}
