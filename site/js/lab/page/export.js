/** What a lab hands over: its script, and its curves. */

/**
 * "Export as Python": the script that the build wrote, with the present values of the controls.
 *
 * The config's `exportPython` is `{name, text}`; `{{control:N}}` in the text stands for the value of control N, a number or a
 * string, which Python writes as JSON does.
 */
export function fillScript(text, values) {
  return text.replace(/\{\{control:(\d+)\}\}/g, (_, index) => JSON.stringify(values[Number(index)]))
}

/**
 * The curves of a lab as a table, comma-separated as RFC 4180 says.
 *
 * @param {{ylabel: string, labels: string[], across?: string[], columns: ArrayLike<number>[]}[]} curves of each plot: what its axis says, the
 *   names of its lines, that of its horizontal axis unless it is the time, and its samples: the same times in all, then one column for each
 *   of these, NaN for a gap
 * @returns {string} a header, then one row for each time
 */
export function curvesText(curves) {
  const names = curves.flatMap(({ ylabel, labels, across = [] }) => [...labels.map((label) => nameOf(label, ylabel)), ...across])
  const columns = [curves[0].columns[0], ...curves.flatMap((curve) => curve.columns.slice(1))]
  const rows = Array.from(columns[0], (_, i) => columns.map((column) => (Number.isFinite(column[i]) ? String(column[i]) : '')))
  return [['time (s)', ...names].map(quoted), ...rows].map((row) => `${row.join(',')}\r\n`).join('')
}

/** The name of a line away from its plot. */
export const nameOf = (label, ylabel) => (ylabel && ylabel !== label ? `${label}: ${ylabel}` : label)

const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
