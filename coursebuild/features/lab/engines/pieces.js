/**
 * Is each piece of lab code one of the kind that it should be? Called by `browser.py` in V8: JSON in, JSON out.
 *
 * 1. It must parse by itself: one that only parses together with what is put around it could end its function and begin another.
 *    An expression must therefore parse between round and between square brackets.
 * 2. It must parse as the function that it becomes. No function is called.
 * 3. It must mean the same in a module, where `await` is a reserved word and `<!--` is no comment, and in the trial's script.
 */

const BODIES = {
  statements: (code) => [code],
  setter: (code) => [code],
  expression: (code) => [`return (${code}\n)`, `return [${code}\n]`],
  target: (code) => [`(${code}\n) = value`, `[${code}\n] = value`],
}
const QUOTED = /\/\*[^]*?\*\/|\/\/.*|'(?:\\[^]|[^'\\\n])*'|"(?:\\[^]|[^"\\\n])*"/g
const UNASSIGNABLE = /assignment target|left-hand side/
const NOT_IN_MODULES = [
  [/\bawait\b/, '`await` has no place in lab code, which never waits'],
  [/<!--|^\s*-->/m, '`<!--` and `-->` begin a comment in some places only; put a space into it'],
]

function mistake({ code, form, text }) {
  try {
    for (const body of BODIES[form](code)) new Function(`"use strict"; ${body}`)
    ;(0, eval)(`"use strict"; (${text})`)
  } catch (error) {
    return form === 'target' && UNASSIGNABLE.test(error.message) ? 'nothing can be assigned to it' : error.message
  }
  // The places of comments are where these are not in quotes; a line end keeps its place.
  const bare = code.replace(QUOTED, (quoted) => (quoted.startsWith('/') ? quoted.replace(/[^\n]/g, ' ') : '""'))
  for (const [pattern, message] of NOT_IN_MODULES) if (pattern.test(bare)) return message
  if (/\barguments\b/.test(bare) && !/\bfunction\b/.test(bare)) return '`arguments` belongs to no function here'
  if (form === 'target' && /^[\w$\s]+$/.test(bare)) return 'it is a name of its own, and no part of the simulation'
  return null
}

globalThis.parsePieces = (json) => JSON.stringify(JSON.parse(json).map(mistake))
