/** Makes elements without markup in strings or style attributes, as a strict content security policy demands. */

export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag)
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue
    if (typeof value === 'function') element.addEventListener(name, value)
    else element.setAttribute(name, value === true ? '' : value)
  }
  element.append(...children.filter((child) => child !== null && child !== undefined))
  return element
}

/** Attributes of messages of the tool, which have no translation. */
export const OF_THE_TOOL = { lang: 'en', dir: 'ltr' }

/** Show text between backticks as code. */
export const formatCode = (text) => text.split(/`([^`]*)`/).map((part, index) => (index % 2 ? h('code', {}, part) : part))
