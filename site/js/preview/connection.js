/**
 * The stream of events, which is closed while the page is hidden, as browsers allow few connections to one host.
 *
 *   connect(page, { hello, page, news, lost })
 *
 * The server sends its whole state whenever a page connects.
 */

const AGAIN = 1000 // ms

export function connect(page, handlers) {
  let source = null
  let timer = null
  const close = () => {
    clearTimeout(timer)
    source?.close()
    source = null
  }
  const open = () => {
    if (source !== null || document.visibilityState === 'hidden') return
    source = new EventSource(`/.coursebuild/events?page=${encodeURIComponent(page)}`)
    for (const name of ['hello', 'page', 'news']) {
      source.addEventListener(name, (event) => handlers[name](JSON.parse(event.data)))
    }
    source.addEventListener('error', () => {
      handlers.lost()
      close()
      timer = setTimeout(open, AGAIN)
    })
  }
  document.addEventListener('visibilitychange', () => (document.visibilityState === 'hidden' ? close() : open()))
  window.addEventListener('pagehide', close)
  window.addEventListener('pageshow', open)
  open()
}
