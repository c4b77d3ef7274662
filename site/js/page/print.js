/** Opens what is folded while the page is printed, for browsers whose print styles cannot. */

export function openForPrint(window) {
  let opened = []
  window.addEventListener('beforeprint', () => {
    opened = [...window.document.querySelectorAll('details:not([open])')]
    for (const details of opened) details.open = true
  })
  window.addEventListener('afterprint', () => {
    for (const details of opened) details.open = false
    opened = []
  })
}
