/** Signs for progress: each a distinct shape, used beside a word. */

import { pictogram } from '../lab/page/dom.js'

/** Lines in a square of 16. */
const SHAPES = {
  begun: 'M4.5 2.500h7v11l-3.500-3-3.500 3z',
  read: 'M2.5 8.500l3.500 3.500 7.500-8',
  right: 'M.8 8.800l3.200 3.200 6.500-7.200M6.800 11.200l.8.8 7.600-8.200',
}

/** An icon in the colour of the text around it. @param {'begun' | 'read' | 'right'} name */
export function sign(name) {
  const svg = pictogram(SHAPES[name])
  svg.setAttribute('class', `sign sign-${name}`)
  return svg
}
