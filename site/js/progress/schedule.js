/**
 * When a question that was missed comes back.
 *
 * S. Leitner's boxes (So lernt man lernen, 1972): a missed question lies in the first box; each time that it is answered right when it
 * is due it moves on by one, and from the last box it leaves; missed again, it starts from the first. The boxes wait 1, 3, 7, 16 and
 * 35 days, each about twice as long as the one before: gaps that grow keep more for the same work (N. Cepeda and others, “Spacing
 * effects in learning”, Psychological Science 19, 2008). An answer given before its day shows that it was read just now, not that it
 * is known, and moves nothing; misses within an hour are one.
 *
 * A question that was right at the first go has never been missed and does not come back.
 */

const HOUR = 3_600_000
const DAY = 24 * HOUR
/** How long a question waits in each box, ms. A day is counted as 20 hours: who reviews each evening is not told to wait until later. */
export const WAITS = Object.freeze([1, 3, 7, 16, 35].map((days) => days * DAY - 4 * HOUR))

/**
 * Where a question stands after some recalls, which are in order.
 * @param {{right: boolean, at: number}[]} recalls times in ms
 * @param {number} now ms
 * @returns {{box: number, due: number} | null} box from 0, and when it is due, ms; `null` where it need not come back
 */
export function standing(recalls, now) {
  let box = -1
  let due = 0
  let missed = -Infinity
  for (const { right, at } of recalls) {
    // A clock was ahead: nobody knows how long ago it was. It has its turn now.
    const time = at > now + DAY ? null : at
    if (right && box >= 0 && (time === null || time >= due)) {
      box += 1
      if (box === WAITS.length) box = -1
      else due = time === null ? now : time + WAITS[box]
    } else if (!right && !(box === 0 && Math.abs(at - missed) < HOUR)) {
      box = 0
      missed = at
      due = time === null ? now : time + WAITS[0]
    }
  }
  return box < 0 ? null : { box, due }
}

/** Whether another recall changes when its question comes back: others need not be kept. */
export function counts(recalls, recall) {
  const before = standing(recalls, recall.at)
  const after = standing([...recalls, recall], recall.at)
  return before?.box !== after?.box || before?.due !== after?.due
}

/**
 * The questions that are due, those of the first boxes first, and how many come later.
 * @template T
 * @param {(T & {recalls: {right: boolean, at: number}[]})[]} answers
 * @returns {{due: (T & {box: number, due: number})[], later: {days: number, count: number}[]}} `later`: in so many days so many
 */
export function agenda(answers, now) {
  const due = []
  const later = new Map()
  for (const answer of answers) {
    const place = standing(answer.recalls, now)
    if (place === null) continue
    if (place.due <= now) due.push({ ...answer, box: place.box, due: place.due })
    else {
      const day = Math.ceil((place.due - now) / DAY)
      later.set(day, (later.get(day) ?? 0) + 1)
    }
  }
  due.sort((a, b) => a.box - b.box || a.due - b.due)
  const days = [...later].sort(([a], [b]) => a - b)
  return { due, later: days.map(([days, count]) => ({ days, count })) }
}
