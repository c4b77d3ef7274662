/** The theme: light, dark or the system's; stored in the reader's browser. */

import { h } from '../lab/page/dom.js'
import { readChoice, writeChoice } from './choices.js'

const KEY = 'coursebuild.theme'
const THEMES = ['auto', 'light', 'dark']

/** The theme that the reader chose; `auto` if none is stored or storage is blocked. */
export function storedTheme() {
  const theme = readChoice(KEY)
  return THEMES.includes(theme) ? theme : 'auto'
}

/** Show a theme: the style sheet reads `data-theme`, the browser's interface the meta element. */
export function applyTheme(theme) {
  const root = document.documentElement
  if (theme === 'auto') delete root.dataset.theme
  else root.dataset.theme = theme
  for (const meta of document.querySelectorAll('meta[name="theme-color"]')) {
    meta.dataset.media ??= meta.media
    const scheme = meta.dataset.media.includes('dark') ? 'dark' : 'light'
    meta.media = theme === 'auto' ? meta.dataset.media : scheme === theme ? 'all' : 'not all'
  }
}

/** Put the switch into the head of the page, and follow a choice made in another tab. */
export function addThemeSwitch(document, words) {
  const tools = document.querySelector('[data-tools]')
  if (!tools) return
  const select = h('select', {}, ...THEMES.map((theme) => new Option(words(`theme.${theme}`), theme)))
  select.value = storedTheme()
  select.addEventListener('change', () => {
    writeChoice(KEY, select.value === 'auto' ? null : select.value)
    applyTheme(select.value)
  })
  window.addEventListener('storage', (event) => {
    if (event.key !== KEY && event.key !== null) return
    select.value = storedTheme()
    applyTheme(select.value)
  })
  tools.append(h('label', { class: 'theme' }, h('span', {}, words('theme.label')), ' ', select))
}
