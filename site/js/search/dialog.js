/**
 * The dialog: a field with a list of what is found, by the pattern of a combobox. The focus stays in the field; arrow
 * keys choose in the list, Enter does what is chosen, Escape closes, and the focus goes back to where it was.
 */

import { matching, numbered, pageActions } from './actions.js'
import { forgetQueries, noteQuery, recentQueries } from './recent.js'
import { address, element, filled, hitParts, pageTitle, summary } from './view.js'

const PAGES = 8
const ACTIONS = 3 // beside results
const LESSONS = 5
const WAIT = 90 // ms after the last key

let dialog = null

/** Open it, with what was typed last selected. */
export function openDialog(context) {
  dialog ??= new SearchDialog(context)
  dialog.open()
}

class SearchDialog {
  constructor(context) {
    this.context = context
    this.strings = null
    this.asked = 0
    this.shown = null // what the list is of
    this.options = []
    this.active = -1
    this.build()
  }

  build() {
    this.input = element('input', {
      id: '_search-field',
      class: 'search-input',
      type: 'text',
      inputmode: 'search',
      enterkeyhint: 'go',
      role: 'combobox',
      'aria-autocomplete': 'list',
      'aria-expanded': 'false',
      'aria-controls': '_search-list',
      autocomplete: 'off',
      autocapitalize: 'off',
      spellcheck: 'false',
      maxlength: '200',
    })
    this.closing = element('button', { type: 'button', class: 'search-close' }, 'Esc')
    this.status = element('p', { class: 'search-status', role: 'status' })
    this.list = element('div', { id: '_search-list', class: 'search-list', role: 'listbox' })
    this.foot = element('div', { class: 'search-foot' })
    const bar = element('div', { class: 'search-bar' }, this.input, this.closing)
    this.dialog = element('dialog', { class: 'search-dialog' }, bar, this.status, this.list, this.foot)
    document.body.append(this.dialog)
    this.closing.addEventListener('click', () => this.close())
    this.dialog.addEventListener('click', (event) => event.target === this.dialog && this.close())
    this.input.addEventListener('input', () => this.later())
    this.input.addEventListener('keydown', (event) => this.key(event))
    this.list.addEventListener('click', (event) => this.clicked(event))
    this.list.addEventListener('pointermove', (event) => this.pointed(event))
  }

  async open() {
    if (this.dialog.open) return this.input.select()
    clearTimeout(this.timer) // of a key before it was closed; the event `close` would come after the next key
    this.dialog.showModal()
    this.input.focus()
    this.input.select()
    if (this.strings === null) await this.prepare()
    this.show(this.input.value)
  }

  /** Words come with the list of pages. */
  async prepare() {
    this.status.textContent = '…'
    try {
      this.listing = await this.context.listing()
    } catch {
      const words = document.querySelector('#_words')?.content.querySelector('[data-key="search.failed"]')
      this.status.textContent = words?.textContent ?? ''
      return
    }
    this.strings = this.listing.strings
    this.dialog.setAttribute('aria-label', this.strings.dialog)
    this.input.setAttribute('aria-label', this.strings.dialog)
    this.input.placeholder = this.strings.placeholder
    this.list.setAttribute('aria-label', this.strings.list)
    this.closing.textContent = this.strings.close
    this.foot.replaceChildren(hint(this.strings), this.shortcutSwitch())
  }

  close() {
    if (this.dialog.open) this.dialog.close()
  }

  later() {
    clearTimeout(this.timer)
    this.timer = setTimeout(() => this.show(this.input.value), WAIT)
  }

  // --- what is shown

  async show(typed) {
    if (this.strings === null) return
    const asked = ++this.asked
    this.showing = typed
    const actions = pageActions(document, this.strings)
    if (typed.trim() === '') return this.render(this.suggestions(actions), '')
    if (typed.trimStart().startsWith('>')) {
      const found = matching(actions, typed.trimStart().slice(1))
      const said = found.length > 0 ? '' : filled(this.strings.none, { query: typed.trim() })
      return this.render([this.actionGroup(found)], said)
    }
    let found
    try {
      found = await this.context.find(typed, PAGES)
    } catch {
      if (asked === this.asked) this.render([], this.strings.failed)
      return
    }
    if (asked !== this.asked) return
    const lessons = numbered(this.listing, typed, LESSONS).map((page) => this.lesson(page))
    const groups = [
      { name: this.strings.goto, options: lessons },
      ...found.pages.map((page) => this.pageGroup(page)),
      this.actionGroup(matching(actions, typed).slice(0, ACTIONS)),
    ]
    if (found.count > PAGES) groups.push({ name: null, options: [this.all(typed)] })
    const nothing = found.count === 0 && groups.every(({ options }) => options.length === 0)
    this.render(groups, nothing || found.count > 0 ? summary(found, this.strings) : '', nothing ? this.strings.advice : '')
  }

  suggestions(actions) {
    const recent = recentQueries(this.context.course)
    const again = (query) => ({ parts: [query], run: () => this.type(query) })
    const forget = { parts: [this.strings.forget], quiet: true, run: () => this.forget() }
    return [
      { name: this.strings.recent, options: recent.length > 0 ? [...recent.map(again), forget] : [] },
      this.actionGroup(actions),
    ]
  }

  forget() {
    forgetQueries(this.context.course)
    this.show('')
    return true
  }

  type(query) {
    this.input.value = query
    this.show(query)
    return true
  }

  actionGroup(actions) {
    const options = actions.map(({ title, href, run }) => ({ parts: [title], href, run: run && (() => this.run(run)) }))
    return { name: this.strings.commands, options }
  }

  lesson([path, kind, title, name]) {
    const page = { kind: this.listing.kinds[kind], name, title: [{ text: title, marked: false }] }
    return { parts: pageTitle(page, this.strings), href: address(this.context.root, path) }
  }

  pageGroup(page) {
    const href = (anchor) => address(this.context.root, page.path, anchor)
    const places = page.hits.filter(({ anchor }) => anchor !== '')
    const lead = page.hits.find(({ anchor }) => anchor === '')
    const top = [element('span', { class: 'found-title' }, ...pageTitle(page, this.strings)), ...(lead ? hitParts(lead) : [])]
    const options = [
      { parts: top, href: href('') },
      ...places.map((hit) => ({ parts: hitParts(hit), href: href(hit.anchor), inner: true })),
    ]
    const label = `${page.name} ${page.title.map(({ text }) => text).join('')}`.trim()
    return { name: label, hidden: true, options: options.map((option) => ({ ...option, found: true })) }
  }

  all(typed) {
    const href = `${this.context.root}search/index.html?q=${encodeURIComponent(typed.trim())}`
    return { parts: [this.strings.all], href, quiet: true, found: true }
  }

  render(groups, said, advice = '') {
    this.shown = this.showing
    this.dialog.dataset.shown = this.shown // what the list is of, for those who watch the page
    const shown = groups.filter(({ options }) => options.length > 0)
    this.options = shown.flatMap(({ options }) => options)
    let number = 0
    this.list.replaceChildren(
      ...shown.map(({ name, hidden, options }) => {
        const made = options.map((option) => this.optionElement(option, number++))
        if (name === null) return made[0]
        const group = element('div', { role: 'group', 'aria-label': name, class: 'search-group' })
        if (!hidden) group.append(element('div', { class: 'search-label', 'aria-hidden': 'true' }, name))
        group.append(...made)
        return group
      }),
    )
    this.list.scrollTop = 0
    this.list.hidden = this.options.length === 0
    this.input.setAttribute('aria-expanded', String(this.options.length > 0))
    this.status.textContent = [said, advice].filter(Boolean).join(' ')
    this.choose(this.options.length > 0 ? 0 : -1)
  }

  optionElement({ parts, href, inner, quiet }, number) {
    const kind = ['search-option', inner && 'search-inner', quiet && 'search-quiet'].filter(Boolean).join(' ')
    const attributes = { role: 'option', id: `_search-${number}`, class: kind, tabindex: '-1', 'data-at': number, 'aria-selected': 'false' }
    return href ? element('a', { ...attributes, href }, ...parts) : element('div', attributes, ...parts)
  }

  // --- what is chosen

  choose(number) {
    const elements = this.list.querySelectorAll('[role="option"]')
    elements[this.active]?.setAttribute('aria-selected', 'false')
    this.active = number
    const chosen = elements[number]
    if (!chosen) return this.input.removeAttribute('aria-activedescendant')
    chosen.setAttribute('aria-selected', 'true')
    this.input.setAttribute('aria-activedescendant', chosen.id)
    if (number === 0) this.list.scrollTop = 0
    else chosen.scrollIntoView({ block: 'nearest' })
  }

  key(event) {
    const last = this.options.length - 1
    if (event.isComposing) return
    if (event.key === 'ArrowDown' || event.key === 'ArrowUp') {
      event.preventDefault()
      const step = event.key === 'ArrowDown' ? 1 : -1
      if (last >= 0) this.choose((this.active + step + last + 1) % (last + 1))
    } else if (event.key === 'Enter') {
      event.preventDefault()
      this.enter(event)
    }
  }

  /** Enter: at once, even where the list is still that of what was typed before. */
  async enter(event) {
    clearTimeout(this.timer)
    if (this.shown !== this.input.value) await this.show(this.input.value)
    const chosen = this.list.querySelectorAll('[role="option"]')[this.active]
    if (!chosen) return
    if (chosen.href && (event.ctrlKey || event.metaKey)) window.open(chosen.href, '_blank', 'noopener')
    else chosen.click()
  }

  pointed({ target }) {
    const at = target.closest('[role="option"]')?.dataset.at
    if (at !== undefined && Number(at) !== this.active) this.choose(Number(at))
  }

  clicked(event) {
    const chosen = event.target.closest('[role="option"]')
    if (!chosen) return
    const option = this.options[Number(chosen.dataset.at)]
    if (option.found) noteQuery(this.context.course, this.input.value)
    if (option.run) {
      if (option.run() !== true) this.close()
      else this.input.focus()
    } else if (!event.ctrlKey && !event.metaKey && !event.shiftKey) {
      this.close() // the link leads on, perhaps to a place on this page
    }
  }

  /** Do something; what it has to say is said where the reader is afterwards. */
  async run(action) {
    this.close()
    let said
    try {
      said = await action()
    } catch {
      return
    }
    if (typeof said === 'string') say(said)
  }

  shortcutSwitch() {
    const box = element('input', { type: 'checkbox' })
    box.checked = this.context.singleKeys()
    box.addEventListener('change', () => this.context.setSingleKeys(box.checked))
    return element('label', { class: 'search-keys' }, box, ' ', this.strings.slash)
  }
}

function hint(strings) {
  const text = filled(strings.hint, { up: '↑', down: '↓', enter: '↵', escape: 'Esc' })
  return element('p', { 'aria-hidden': 'true' }, text)
}

/** Say something that is shown for a moment. */
function say(text) {
  const note = element('p', { class: 'search-said', role: 'status' })
  document.body.append(note)
  // A live region has to be there before its text is.
  setTimeout(() => (note.textContent = text), 50)
  setTimeout(() => note.remove(), 3000)
}
