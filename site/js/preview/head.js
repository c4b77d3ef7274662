/** Takes over a new page's title, language and style sheet. Its scripts cannot be taken over. */

const scripts = (page) => [...page.querySelectorAll('head script[src]')].map((script) => script.getAttribute('src')).join('\n')
const sheet = (page) => page.querySelector('head link[rel="stylesheet"]')

/** Whether the page must be loaded as a whole. */
export function needsLoad(old, next) {
  return scripts(old) !== scripts(next)
}

export function takeHead(next) {
  document.title = next.title
  document.documentElement.lang = next.documentElement.lang
  takeSheet(sheet(next)?.getAttribute('href'))
}

/** Replace the style sheet once the new one and its fonts are loaded, so that nothing flashes. */
async function takeSheet(address) {
  const old = sheet(document)
  if (!address || !old || old.dataset.next === address) return
  if (!old.dataset.next && old.getAttribute('href') === address) return
  old.dataset.next = address
  await loadFonts(new URL(address, document.baseURI)).catch(() => {})
  if (old.dataset.next !== address) return // there is a newer one
  const fresh = document.createElement('link')
  fresh.rel = 'stylesheet'
  fresh.href = address
  fresh.addEventListener('load', () => old.remove())
  fresh.addEventListener('error', () => fresh.remove())
  old.after(fresh)
}

async function loadFonts(address) {
  const text = await (await fetch(address)).text()
  const fonts = [...text.matchAll(/url\(["']?([^"')]+\.woff2)["']?\)/g)].map(([, file]) => new URL(file, address))
  await Promise.all(fonts.map(async (font) => (await fetch(font)).arrayBuffer()))
}
