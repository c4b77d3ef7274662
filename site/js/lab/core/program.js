/**
 * Runs the programs that the build makes of an author's expressions (coursebuild/features/lab/equations/formula.py). They are data:
 * nothing is evaluated as code.
 *
 *   link([2, [1], '*'])  → (env) => 2 * env[1]
 */

/** @typedef {(env: Float64Array) => number} Formula */

const truth = (value) => value !== 0 && value === value
const mod = (a, b) => a - b * Math.floor(a / b)
// Like Python's, a power of 1 is 1.
const pow = (a, b) => (a === 1 ? 1 : a ** b)

/** @type {Record<string, (...parts: Formula[]) => Formula>} */
const OPERATIONS = {
  nan: () => () => NaN,
  '+': (a, b) => (env) => a(env) + b(env),
  '-': (a, b) => (env) => a(env) - b(env),
  '*': (a, b) => (env) => a(env) * b(env),
  '/': (a, b) => (env) => a(env) / b(env),
  '**': (a, b) => (env) => pow(a(env), b(env)),
  '%': (a, b) => (env) => mod(a(env), b(env)),
  neg: (a) => (env) => -a(env),
  not: (a) => (env) => (truth(a(env)) ? 0 : 1),
  and: (a, b) => (env) => (truth(a(env)) && truth(b(env)) ? 1 : 0),
  or: (a, b) => (env) => (truth(a(env)) || truth(b(env)) ? 1 : 0),
  '<': (a, b) => (env) => (a(env) < b(env) ? 1 : 0),
  '<=': (a, b) => (env) => (a(env) <= b(env) ? 1 : 0),
  '>': (a, b) => (env) => (a(env) > b(env) ? 1 : 0),
  '>=': (a, b) => (env) => (a(env) >= b(env) ? 1 : 0),
  '==': (a, b) => (env) => (a(env) === b(env) ? 1 : 0),
  '!=': (a, b) => (env) => (a(env) !== b(env) ? 1 : 0),
  if: (test, a, b) => (env) => (truth(test(env)) ? a(env) : b(env)),
}
for (const name of ['atan2', 'hypot', 'min', 'max']) {
  const run = Math[name]
  OPERATIONS[name] = (a, b) => (env) => run(a(env), b(env))
}
for (const name of [
  'sin', 'cos', 'tan', 'asin', 'acos', 'atan', 'sinh', 'cosh', 'tanh', 'asinh', 'acosh', 'atanh', 'exp', 'log', 'log2', 'log10', 'sqrt',
  'cbrt', 'abs', 'sign', 'floor', 'ceil',
]) { // prettier-ignore
  const run = Math[name]
  OPERATIONS[name] = (a) => (env) => run(a(env))
}

/**
 * Make a function of a program.
 *
 * @param {(number | string | number[])[]} program in postfix order
 * @returns {Formula}
 */
export function link(program) {
  /** @type {Formula[]} */
  const stack = []
  for (const item of program) {
    if (typeof item === 'number') stack.push(() => item)
    else if (typeof item === 'string') {
      const make = OPERATIONS[item]
      stack.push(make(...stack.splice(stack.length - make.length)))
    } else {
      const [slot] = item
      stack.push((env) => env[slot])
    }
  }
  return stack[0]
}
