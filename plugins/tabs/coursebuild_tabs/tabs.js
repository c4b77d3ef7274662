/** Makes tabs of versions of a text, by the pattern of the ARIA Authoring Practices: arrows choose, Home and End lead to the ends. */

let made = 0

function mount(block) {
  const sections = [...block.querySelectorAll(':scope > section')]
  const bar = document.createElement('div')
  bar.className = 'tab-bar'
  bar.setAttribute('role', 'tablist')
  const buttons = sections.map((section) => {
    const title = section.querySelector('.tab-title')
    const button = document.createElement('button')
    const name = `_tab-${(made += 1)}`
    button.type = 'button'
    button.id = name
    button.textContent = title.textContent
    button.setAttribute('role', 'tab')
    section.id ||= `${name}-text`
    button.setAttribute('aria-controls', section.id)
    section.setAttribute('role', 'tabpanel')
    section.setAttribute('aria-labelledby', name)
    title.hidden = true
    bar.append(button)
    return button
  })
  const choose = (chosen) =>
    buttons.forEach((button, at) => {
      button.setAttribute('aria-selected', String(at === chosen))
      button.tabIndex = at === chosen ? 0 : -1
      sections[at].hidden = at !== chosen
    })
  buttons.forEach((button, at) => button.addEventListener('click', () => choose(at)))
  bar.addEventListener('keydown', (event) => {
    const at = buttons.indexOf(document.activeElement)
    const last = buttons.length - 1
    const to = { ArrowRight: at === last ? 0 : at + 1, ArrowLeft: at === 0 ? last : at - 1, Home: 0, End: last }[event.key]
    if (to === undefined) return
    event.preventDefault()
    choose(to)
    buttons[to].focus()
  })
  // A link, or a search in the page, may lead into a tab that is not shown.
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)))
    const at = sections.findIndex((section) => section.contains(target))
    if (at >= 0) choose(at)
  }
  addEventListener('hashchange', reveal)
  block.prepend(bar)
  choose(0)
  reveal()
}

document.querySelectorAll('[data-tabs]').forEach(mount)
