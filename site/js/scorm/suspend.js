/**
 * What a lesson leaves with the platform so that it goes on where it was left, on any machine: `cmi.suspend_data`, 4096 characters.
 *
 * JSON: `{"v": 1, "r": read, "q": {QUIZ: {KEY: [kind, right, tries, hints, number, at in s, given]}}}`. Where that is too long, what
 * was entered is left out, the longest first; then whole answers, the oldest first.
 */

const LONGEST = 4096
const VERSION = 1
const KINDS = ['mcq', 'several', 'predict', 'numeric', 'open', 'output', 'order']

/**
 * @param {{quiz: string, key: string, kind: string, given: unknown, right: boolean | null, tries: number, hints: number,
 *   number: number, at: string}[]} answers
 * @param {boolean} read
 * @returns {string}
 */
export function packed(answers, read) {
  const kept = [...answers].sort((a, b) => (a.at < b.at ? 1 : -1))
  const size = ({ given }) => JSON.stringify(given).length
  const entered = kept.filter(({ given }) => given !== null).sort((a, b) => size(b) - size(a))
  const without = (count) => {
    const bare = new Set(entered.slice(0, count))
    const left = kept.slice(0, kept.length - Math.max(0, count - entered.length))
    return written(left.map((answer) => (bare.has(answer) ? { ...answer, given: null } : answer)), read)
  }
  let [fewest, most] = [0, entered.length + kept.length]
  while (fewest < most) {
    const middle = Math.floor((fewest + most) / 2)
    if (without(middle).length <= LONGEST) most = middle
    else fewest = middle + 1
  }
  return without(fewest)
}

function written(answers, read) {
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
 * What `packed` gave; what is damaged, or of another version, is nothing, and entries that cannot be are passed over.
 * @returns {{answers: object[], read: boolean}}
 */
export function unpacked(text) {
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
  const known = KINDS[kind] !== undefined && [0, 1, 2].includes(right)
  if (!known || ![tries, hints, number, at].every(isCount) || at > 8e9) return null
  const verdict = right === 2 ? null : right === 1
  return { quiz, key, kind: KINDS[kind], given, right: verdict, tries, hints, number, at: new Date(at * 1000).toISOString() }
}
