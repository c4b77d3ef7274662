/** Puts values into interface texts: `fill('diverged at t = {t} s', { t: '1.20' })`. A name without a value stays. */
export function fill(text, values = {}) {
  return text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole))
}
