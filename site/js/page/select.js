/** All elements of a part of the page that match a selector, including the part itself. */
export function selectAll(root, selector) {
  const rootMatch = root.matches?.(selector) ? [root] : []
  return [...rootMatch, ...root.querySelectorAll(selector)]
}
