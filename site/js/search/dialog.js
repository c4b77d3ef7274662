/**
 * The search dialog: a combobox, that is a field with a list of results. The focus stays in the field; arrow keys choose
 * an option, Enter opens it, Escape closes the dialog, and the focus returns to where it was.
 */

import { h } from '../lab/page/dom.js'
import { fill, readWords } from '../page/words.js'
import { matchActions, pagesByNumber, pageActions } from './actions.js'
import { forgetQueries, noteQuery, recentQueries } from './recent.js'
import { address, hitParts, pageTitle, summary } from './view.js'

const PAGES = 8
const ACTIONS = 3 // beside results
const LESSONS = 5
const WAIT = 90 // ms after the last key

let dialog = null

/** Open the dialog, with the last query selected. */
export function openDialog(context) {
  dialog ??= new SearchDialog(context)
  dialog.open()
}

class SearchDialog {
  constructor(context) {
    this.context = context
    this.strings = null
    this.requestNumber = 0
    this.listedQuery = null // the query whose results are listed
    this.options = []
    this.active = -1
    this.build()
  }

  build() {
    this.input = h('input', {
      id: '_search-field',
      class: 'search-input',
      type: 'text',
      inputMode: 'search',
      enterKeyHint: 'go',
      role: 'combobox',
      'aria-autocomplete': 'list',
      'aria-expanded': 'false',
      'aria-controls': '_search-list',
      autocomplete: 'off',
      autocapitalize: 'off',
      spellcheck: false,
      maxLength: 200,
    })
    this.closeButton = h('button', { type: 'button', class: 'search-close' }, 'Esc')
    this.status = h('p', { class: 'search-status', role: 'status' })
    this.list = h('div', { id: '_search-list', class: 'search-list', role: 'listbox' })
    this.foot = h('div', { class: 'search-foot' })
    const bar = h('div', { class: 'search-bar' }, this.input, this.closeButton)
    this.dialog = h('dialog', { class: 'search-dialog' }, bar, this.status, this.list, this.foot)
    document.body.append(this.dialog)
    this.closeButton.addEventListener('click', () => this.close())
    this.dialog.addEventListener('click', (event) => event.target === this.dialog && this.close())
    this.input.addEventListener('input', () => this.scheduleSearch())
    this.input.addEventListener('keydown', (event) => this.onKey(event))
    this.list.addEventListener('click', (event) => this.onClick(event))
    this.list.addEventListener('pointermove', (event) => this.onPointerMove(event))
  }

  async open() {
    if (this.dialog.open) return this.input.select()
    clearTimeout(this.timer) // of a key before the dialog was closed; an event `close` would come too late
    this.dialog.showModal()
    this.input.focus()
    this.input.select()
    if (this.strings === null) await this.prepare()
    this.show(this.input.value)
  }

  /** Load the list of pages, which holds the interface texts. */
  async prepare() {
    this.status.textContent = '…'
    try {
      this.listing = await this.context.listing()
    } catch {
      this.status.textContent = readWords(document)('search.failed')
      return
    }
    this.strings = this.listing.strings
    this.dialog.setAttribute('aria-label', this.strings.dialog)
    this.input.setAttribute('aria-label', this.strings.dialog)
    this.input.placeholder = this.strings.placeholder
    this.list.setAttribute('aria-label', this.strings.list)
    this.closeButton.textContent = this.strings.close
    this.foot.replaceChildren(hint(this.strings), this.shortcutSwitch())
  }

  close() {
    if (this.dialog.open) this.dialog.close()
  }

  scheduleSearch() {
    clearTimeout(this.timer)
    this.timer = setTimeout(() => this.show(this.input.value), WAIT)
  }

  // --- results

  async show(query) {
    if (this.strings === null) return
    const request = ++this.requestNumber
    this.currentQuery = query
    const actions = pageActions(document, this.strings)
    if (query.trim() === '') return this.render(this.suggestions(actions), '')
    if (query.trimStart().startsWith('>')) {
      const matches = matchActions(actions, query.trimStart().slice(1))
      const status = matches.length > 0 ? '' : fill(this.strings.none, { query: query.trim() })
      return this.render([this.actionGroup(matches)], status)
    }
    let result
    try {
      result = await this.context.find(query, PAGES)
    } catch {
      if (request === this.requestNumber) this.render([], this.strings.failed)
      return
    }
    if (request !== this.requestNumber) return
    const lessons = pagesByNumber(this.listing, query, LESSONS).map((page) => this.lesson(page))
    const groups = [
      { name: this.strings.goto, options: lessons },
      ...result.pages.map((page) => this.pageGroup(page)),
      this.actionGroup(matchActions(actions, query).slice(0, ACTIONS)),
    ]
    if (result.count > PAGES) groups.push({ name: null, options: [this.allResults(query)] })
    const isEmpty = result.count === 0 && groups.every(({ options }) => options.length === 0)
    this.render(groups, isEmpty || result.count > 0 ? summary(result, this.strings) : '', isEmpty ? this.strings.advice : '')
  }

  suggestions(actions) {
    const recent = recentQueries(this.context.course)
    const repeat = (query) => ({ parts: [query], run: () => this.type(query) })
    const forget = { parts: [this.strings.forget], quiet: true, run: () => this.forget() }
    return [
      { name: this.strings.recent, options: recent.length > 0 ? [...recent.map(repeat), forget] : [] },
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
    const page = { kind: this.listing.kinds[kind], name, title: [{ text: title, isMarked: false }] }
    return { parts: pageTitle(page, this.strings), href: address(this.context.root, path) }
  }

  pageGroup(page) {
    const href = (anchor) => address(this.context.root, page.path, anchor)
    const places = page.hits.filter(({ anchor }) => anchor !== '')
    const lead = page.hits.find(({ anchor }) => anchor === '')
    const top = [h('span', { class: 'found-title' }, ...pageTitle(page, this.strings)), ...(lead ? hitParts(lead) : [])]
    const options = [
      { parts: top, href: href('') },
      ...places.map((hit) => ({ parts: hitParts(hit), href: href(hit.anchor), inner: true })),
    ]
    const label = `${page.name} ${page.title.map(({ text }) => text).join('')}`.trim()
    return { name: label, hidden: true, options: options.map((option) => ({ ...option, isResult: true })) }
  }

  allResults(query) {
    const href = `${this.context.root}search/index.html?q=${encodeURIComponent(query.trim())}`
    return { parts: [this.strings.all], href, quiet: true, isResult: true }
  }

  render(groups, status, advice = '') {
    this.listedQuery = this.currentQuery
    this.dialog.dataset.shown = this.listedQuery // for tests and other observers of the page
    const visibleGroups = groups.filter(({ options }) => options.length > 0)
    this.options = visibleGroups.flatMap(({ options }) => options)
    let number = 0
    this.list.replaceChildren(
      ...visibleGroups.map(({ name, hidden, options }) => {
        const elements = options.map((option) => this.optionElement(option, number++))
        if (name === null) return elements[0]
        const group = h('div', { role: 'group', 'aria-label': name, class: 'search-group' })
        if (!hidden) group.append(h('div', { class: 'search-label', 'aria-hidden': 'true' }, name))
        group.append(...elements)
        return group
      }),
    )
    this.list.scrollTop = 0
    this.list.hidden = this.options.length === 0
    this.input.setAttribute('aria-expanded', String(this.options.length > 0))
    this.status.textContent = [status, advice].filter(Boolean).join(' ')
    this.choose(this.options.length > 0 ? 0 : -1)
  }

  optionElement({ parts, href, inner, quiet }, number) {
    const kind = ['search-option', inner && 'search-inner', quiet && 'search-quiet'].filter(Boolean).join(' ')
    const attributes = { role: 'option', id: `_search-${number}`, class: kind, tabIndex: -1, 'data-at': number, 'aria-selected': 'false' }
    return href ? h('a', { ...attributes, href }, ...parts) : h('div', attributes, ...parts)
  }

  // --- choice

  choose(number) {
    const elements = this.list.querySelectorAll('[role="option"]')
    elements[this.active]?.setAttribute('aria-selected', 'false')
    this.active = number
    const option = elements[number]
    if (!option) return this.input.removeAttribute('aria-activedescendant')
    option.setAttribute('aria-selected', 'true')
    this.input.setAttribute('aria-activedescendant', option.id)
    if (number === 0) this.list.scrollTop = 0
    else option.scrollIntoView({ block: 'nearest' })
  }

  onKey(event) {
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

  /** Enter: open the first result of the present query, even if the list still shows those of an earlier one. */
  async enter(event) {
    clearTimeout(this.timer)
    if (this.listedQuery !== this.input.value) await this.show(this.input.value)
    const option = this.list.querySelectorAll('[role="option"]')[this.active]
    if (!option) return
    if (option.href && (event.ctrlKey || event.metaKey)) window.open(option.href, '_blank', 'noopener')
    else option.click()
  }

  onPointerMove({ target }) {
    const index = target.closest('[role="option"]')?.dataset.at
    if (index !== undefined && Number(index) !== this.active) this.choose(Number(index))
  }

  onClick(event) {
    const target = event.target.closest('[role="option"]')
    if (!target) return
    const option = this.options[Number(target.dataset.at)]
    if (option.isResult) noteQuery(this.context.course, this.input.value)
    if (option.run) {
      if (option.run() !== true) this.close()
      else this.input.focus()
    } else if (!event.ctrlKey && !event.metaKey && !event.shiftKey) {
      this.close() // the link leads on, perhaps to a place on this page
    }
  }

  /** Do an action, and show its message on the page that the reader is then on. */
  async run(action) {
    this.close()
    let message
    try {
      message = await action()
    } catch {
      return
    }
    if (typeof message === 'string') say(message)
  }

  shortcutSwitch() {
    const box = h('input', { type: 'checkbox' })
    box.checked = this.context.singleKeys()
    box.addEventListener('change', () => this.context.setSingleKeys(box.checked))
    return h('label', { class: 'search-keys' }, box, ' ', this.strings.slash)
  }
}

function hint(strings) {
  const text = fill(strings.hint, { up: '↑', down: '↓', enter: '↵', escape: 'Esc' })
  return h('p', { 'aria-hidden': 'true' }, text)
}

/** Show a message for a moment. */
function say(text) {
  const note = h('p', { class: 'search-said', role: 'status' })
  document.body.append(note)
  // A live region must exist before its text.
  setTimeout(() => (note.textContent = text), 50)
  setTimeout(() => note.remove(), 3000)
}
