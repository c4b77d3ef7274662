/**
 * "Export as Python": the script that the build wrote, with the present values of the controls.
 *
 * The config's `exportPython` is `{name, text}`; `{{control:N}}` in the text stands for the value of control N, a number or a
 * string, which Python writes as JSON does.
 */

/** The text of the script. */
export function fillScript(text, values) {
  return text.replace(/\{\{control:(\d+)\}\}/g, (_, index) => JSON.stringify(values[Number(index)]))
}
