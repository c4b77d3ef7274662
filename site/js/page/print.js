/** Prepares for print: sets the running title, and opens folds for browsers in which style sheets cannot. */

/** A text as a string of CSS. */
export function cssString(text) {
  return `"${text.replaceAll(/["\\]/g, '\\$&').replaceAll(/[\n\r\f\0]/g, ' ')}"`
}

export function openForPrint(window) {
  const { documentElement } = window.document
  let openedFolds = []
  window.addEventListener('beforeprint', () => {
    documentElement.style.setProperty('--running-title', cssString(window.document.title))
    openedFolds = [...window.document.querySelectorAll('details:not([open])')]
    for (const details of openedFolds) details.open = true
  })
  window.addEventListener('afterprint', () => {
    for (const details of openedFolds) details.open = false
    openedFolds = []
  })
}
