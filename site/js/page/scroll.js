/**
 * Boxes that may scroll can be reached by keyboard in the finished page. Where nothing is cut off there is nothing to
 * scroll, and the stop is taken away.
 */

export function freeUnscrolled(document) {
  const boxes = [...document.querySelectorAll('[tabindex="0"]')]
  const update = (box) => {
    const scrolls = box.scrollWidth > box.clientWidth + 1 || box.scrollHeight > box.clientHeight + 1
    if (scrolls) box.tabIndex = 0
    else box.removeAttribute('tabindex')
  }
  const observer = new ResizeObserver((entries) => entries.forEach(({ target }) => update(target)))
  for (const box of boxes) observer.observe(box)
}
