/**
 * The stream of events, which ends while nobody looks at the page: browsers allow few connections to one place.
 *
 *   connect(page, { hello, page, news, lost })
 *
 * However long a page was away, the server tells how things stand when it is back.
 */

const AGAIN = 1000 // ms

export function connect(page, on) {
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
      source.addEventListener(name, (event) => on[name](JSON.parse(event.data)))
    }
    source.addEventListener('error', () => {
      on.lost()
      close()
      timer = setTimeout(open, AGAIN)
    })
  }
  document.addEventListener('visibilitychange', () => (document.visibilityState === 'hidden' ? close() : open()))
  window.addEventListener('pagehide', close)
  window.addEventListener('pageshow', open)
  open()
}
