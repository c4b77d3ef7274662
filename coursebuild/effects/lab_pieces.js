/**
 * Does each piece of lab code parse by itself? Called by `lab_engine.py` in V8: JSON in, JSON out.
 *
 * A piece that only parses together with what is put around it could end its function and begin another; an expression must
 * therefore parse between round and between square brackets.
 */

globalThis.parsePieces = (json) => {
  const NAMES = ['model', 'data', 'mj', 'sim', 'ctx', 'lib', 'value']
  const bodies = {
    statements: (code) => [code],
    expression: (code) => [`return (${code}\n)`, `return [${code}\n]`],
    target: (code) => [`(${code}\n) = value`, `[${code}\n] = value`],
  }
  const mistake = ({ code, form }) => {
    for (const body of bodies[form](code)) {
      try {
        new Function(...NAMES, `"use strict"; ${body}`)
      } catch (error) {
        return error.message
      }
    }
    return null
  }
  return JSON.stringify(JSON.parse(json).map(mistake))
}
