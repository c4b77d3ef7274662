/** All elements of a part of the page that match a selector, including the part itself. */
export function selectAll(root, selector) {
  const rootMatch = root.matches?.(selector) ? [root] : []
  return [...rootMatch, ...root.querySelectorAll(selector)]
}

/** The text of an element without some of its parts, on one line. */
export function textWithout(element, selector) {
  const copy = element.cloneNode(true)
  for (const part of copy.querySelectorAll(selector)) part.remove()
  return copy.textContent.replace(/\s+/g, ' ').trim()
}
