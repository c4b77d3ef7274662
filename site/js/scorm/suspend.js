/**
 * The data that a lesson stores in the platform, so that it can be resumed on any machine: `cmi.suspend_data`, 4096 characters.
 *
 * JSON: `{"v": 1, "r": read, "q": {QUIZ: {KEY: [kind, right, tries, hints, number, at in s, given]}}}`. If that is too long, entered
 * texts are left out, the longest first; then whole answers, the oldest first.
 */

const LONGEST = 4096
const VERSION = 1
const KINDS = ['mcq', 'several', 'predict', 'numeric', 'open', 'output', 'order', 'exercise']

/**
 * @param {{quiz: string, key: string, kind: string, given: unknown, right: boolean | null, tries: number, hints: number,
 *   number: number, at: string}[]} answers
 * @param {boolean} read
 * @returns {string}
 */
export function pack(answers, read) {
  const newestFirst = [...answers].sort((a, b) => (a.at < b.at ? 1 : -1))
  const size = ({ given }) => JSON.stringify(given).length
  const withText = newestFirst.filter(({ given }) => given !== null).sort((a, b) => size(b) - size(a))
  const shorten = (count) => {
    const bare = new Set(withText.slice(0, count))
    const remaining = newestFirst.slice(0, newestFirst.length - Math.max(0, count - withText.length))
    return serialize(remaining.map((answer) => (bare.has(answer) ? { ...answer, given: null } : answer)), read)
  }
  let [fewest, enough] = [0, withText.length + newestFirst.length]
  while (fewest < enough) {
    const middle = Math.floor((fewest + enough) / 2)
    if (shorten(middle).length <= LONGEST) enough = middle
    else fewest = middle + 1
  }
  return shorten(fewest)
}

function serialize(answers, read) {
  const q = Object.create(null) // a quiz can have any name
  for (const { quiz, key, kind, given, right, tries, hints, number, at } of answers) {
    const entry = [KINDS.indexOf(kind), right === null ? 2 : Number(right), tries, hints, number, Math.floor(Date.parse(at) / 1000)]
    if (given !== null) entry.push(given)
    q[quiz] ??= Object.create(null)
    q[quiz][key] = entry
  }
  return JSON.stringify({ v: VERSION, r: Number(read), q })
}

/**
 * Read what `pack` wrote. A damaged text, or one of another version, is empty; invalid entries are skipped.
 * @returns {{answers: Record<string, any>[], read: boolean}}
 */
export function unpack(text) {
  let data
  try {
    data = JSON.parse(text)
  } catch {
    return { answers: [], read: false }
  }
  if (data?.v !== VERSION || typeof data.q !== 'object' || data.q === null) return { answers: [], read: false }
  const answers = []
  for (const [quiz, entries] of Object.entries(data.q)) {
    for (const [key, entry] of Object.entries(entries ?? {})) {
      const answer = answerOf(quiz, key, entry)
      if (answer) answers.push(answer)
    }
  }
  return { answers, read: data.r === 1 }
}

const isCount = (value) => Number.isInteger(value) && value >= 0

function answerOf(quiz, key, entry) {
  if (!Array.isArray(entry)) return null
  const [kind, right, tries, hints, number, at, given = null] = entry
  const isKnown = KINDS[kind] !== undefined && [0, 1, 2].includes(right)
  if (!isKnown || ![tries, hints, number, at].every(isCount) || at > 8e9) return null
  const verdict = right === 2 ? null : right === 1
  return { quiz, key, kind: KINDS[kind], given, right: verdict, tries, hints, number, at: new Date(at * 1000).toISOString() }
}
