/** All elements of a part of the page that a selector names, the part itself included. */
export function within(root, selector) {
  const own = root.matches?.(selector) ? [root] : []
  return [...own, ...root.querySelectorAll(selector)]
}
