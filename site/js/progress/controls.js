/** The controls that export progress as a file, import it, and reset it. */

import { download, h } from '../lab/page/dom.js'
import { ImportError, importText } from './exchange.js'
import { say } from '../page/words.js'

export function addControls(document, words, progress) {
  const control = (name) => document.querySelector(`[data-control="${name}"]`)
  const key = document.documentElement.dataset.course
  addExport(control('export'), key, words, progress)
  addImport(control('import'), words, progress)
  addReset(control('reset'), key, words, progress)
}

const button = (text, onclick, properties = {}) => h('button', { type: 'button', class: 'quiet', onclick, ...properties }, text)
const status = () => h('p', { class: 'told', role: 'status' })
const fileName = (key) => `progress-${key}-${new Date().toISOString().slice(0, 10)}.json`

function save(key, progress) {
  const name = fileName(key)
  download(name, progress.exportText(), 'application/json')
  return name
}

function addExport(place, key, words, progress) {
  const message = status()
  const act = () => (message.textContent = say(words, 'progress.live.saved', { name: save(key, progress) }))
  place.append(button(words('progress.live.export'), act), message)
  const damaged = progress.damagedText()
  if (damaged === null) return
  const part = h('div', { class: 'aside-part' }, h('p', {}, words('progress.live.aside')))
  const drop = () => {
    progress.dropDamaged()
    part.remove()
    place.querySelector('button').focus()
  }
  const keep = () => download(fileName(`${key}-damaged`), damaged, 'text/plain')
  part.append(button(words('progress.live.aside_save'), keep), ' ', button(words('progress.live.aside_drop'), drop))
  place.append(part)
}

function addImport(place, words, progress) {
  const message = status()
  const label = h('label', { class: 'file' }, h('span', {}, words('progress.live.import')), ' ')
  const input = h('input', { type: 'file', accept: '.json,application/json' })
  label.append(input)
  input.addEventListener('change', async () => {
    const [file] = input.files
    if (!file) return
    message.replaceChildren()
    let text = null
    try {
      text = await file.text()
      tellImported(message, importText(progress, text), text, words, progress)
    } catch (error) {
      message.replaceChildren(h('span', { class: 'wrong' }, errorText(error, text, words)))
    }
    input.value = '' // the same file may be chosen again
  })
  place.append(label, message)
}

function errorText(error, text, words) {
  if (text === null) return words('progress.live.error_unread')
  if (!(error instanceof ImportError)) throw error
  return say(words, `progress.live.error_${error.code}`, { detail: error.detail })
}

function tellImported(message, { answers, lessons, restorable }, text, words, progress) {
  const amounts = { answers: say(words, 'progress.live.answers_n', { n: answers }), lessons: say(words, 'progress.live.lessons_n', { n: lessons }) }
  message.textContent = answers || lessons ? say(words, 'progress.live.imported', amounts) : words('progress.live.imported_none')
  if (!restorable) return
  const restore = () => {
    tellImported(message, importText(progress, text, { restore: true }), text, words, progress)
    message.tabIndex = -1
    message.focus()
  }
  message.append(' ', say(words, 'progress.live.restorable', { n: restorable }), ' ', button(words('progress.live.restore'), restore))
}

function addReset(place, key, words, progress) {
  const message = status()
  const open = button(words('progress.live.reset'), () => {
    summary.textContent = say(words, 'progress.live.reset_what', {
      answers: say(words, 'progress.live.answers_n', { n: progress.all().length }),
      lessons: say(words, 'progress.live.lessons_n', { n: progress.lessons().size }),
    })
    dialog.showModal()
  })
  const summary = h('p')
  const forget = () => {
    const backup = progress.exportText()
    progress.reset()
    dialog.close()
    const undo = () => {
      importText(progress, backup, { restore: true })
      message.textContent = words('progress.live.undone')
      open.focus()
    }
    message.replaceChildren(words('progress.live.reset_done'), ' ', button(words('progress.live.undo'), undo))
  }
  const dialog = h(
    'dialog',
    { class: 'ask', 'aria-labelledby': 'ask-title' },
    h('h2', { id: 'ask-title' }, words('progress.live.reset_ask')),
    summary,
    h(
      'p',
      { class: 'choices' },
      button(words('progress.live.cancel'), () => dialog.close(), { autofocus: true }),
      ' ',
      button(words('progress.live.export'), () => save(key, progress)),
      ' ',
      button(words('progress.live.reset_yes'), forget, { class: 'quiet firm' }),
    ),
  )
  place.append(open, message, dialog)
}
