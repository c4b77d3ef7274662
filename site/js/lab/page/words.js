/** Puts values into interface texts: `fill('diverged at t = {t} s', { t: '1.20' })`. A name without a value stays. */
export function fill(text, values = {}) {
  const words = text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole))
  return FROM_THE_RIGHT.test(text) ? words.replace(QUANTITY, '\u2066$&\u2069') : words
}

const FROM_THE_RIGHT = /[\p{Script=Arabic}\p{Script=Hebrew}]/u

/** Numbers with a sign or a unit, which would stand on the wrong side of them in text from the right; with a unit before a Latin word they do not. */
const QUANTITY = /(?<![\w.,]|[A-Za-z] *= *)(?:[-+−±]\d[\d.,]*(?:[ \u00a0]?[A-Za-zµΩ°%][\w/²³·]*)?|\d[\d.,]*[ \u00a0]?[A-Za-zµΩ°%][\w/²³·]*(?![\w/²³·]|[ \u00a0][A-Za-z]))/g
