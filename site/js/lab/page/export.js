/**
 * "Export as Python": the script that the build wrote, with the controls as they are now.
 *
 * The config's `exportPython` is `{name, text}`; `{{control:N}}` in the text stands for the value of control N.
 */

/** A value of a control as Python writes it. */
export function pythonLiteral(value) {
  if (value === null || value === undefined) return 'None'
  if (typeof value === 'boolean') return value ? 'True' : 'False'
  if (typeof value === 'number') return pythonNumber(value)
  // JSON's escapes are Python's, but for the two halves of a character beyond 16 bits, which are written as they are.
  return JSON.stringify(String(value))
}

function pythonNumber(value) {
  if (Number.isNaN(value)) return 'float("nan")'
  if (!Number.isFinite(value)) return value > 0 ? 'float("inf")' : 'float("-inf")'
  return Object.is(value, -0) ? '-0.0' : String(value)
}

/** The text of the script. */
export function fillScript(text, values) {
  return text.replace(/\{\{control:(\d+)\}\}/g, (_, index) => pythonLiteral(values[Number(index)]))
}
