/** For paper: the running title, and what is folded is opened for browsers whose print styles cannot. */

/** A text as a string of CSS. */
export function cssString(text) {
  return `"${text.replaceAll(/["\\]/g, '\\$&').replaceAll(/[\n\r\f\0]/g, ' ')}"`
}

export function openForPrint(window) {
  const { documentElement } = window.document
  let opened = []
  window.addEventListener('beforeprint', () => {
    documentElement.style.setProperty('--running-title', cssString(window.document.title))
    opened = [...window.document.querySelectorAll('details:not([open])')]
    for (const details of opened) details.open = true
  })
  window.addEventListener('afterprint', () => {
    for (const details of opened) details.open = false
    opened = []
  })
}
