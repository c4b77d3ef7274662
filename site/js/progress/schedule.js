/**
 * Schedules the review of missed questions.
 *
 * S. Leitner's boxes (So lernt man lernen, 1972): a missed question lies in the first box; each time that it is answered right when it
 * is due it moves on by one, and from the last box it leaves; missed again, it starts from the first. The boxes wait 1, 3, 7, 16 and
 * 35 days, each two to three times as long as the one before: growing gaps lead to better memory for the same work (N. Cepeda and others,
 * “Spacing effects in learning”, Psychological Science 19, 2008). An answer given before its day shows that it was just read, not
 * that it is known, and changes nothing; misses within an hour count as one.
 *
 * A question that was answered right at the first attempt does not come back.
 */

const HOUR = 3_600_000
const DAY = 24 * HOUR
/** How long a question waits in each box, ms: four hours less than whole days, for those who review a little earlier each evening. */
export const WAITS = Object.freeze([1, 3, 7, 16, 35].map((days) => days * DAY - 4 * HOUR))

/**
 * The state of a question after these recalls, which are in order.
 * @param {{right: boolean, at: number}[]} recalls times in ms
 * @param {number} now ms
 * @returns {{box: number, due: number} | null} box from 0, and when it is due, ms; `null` if it need not come back
 */
export function reviewState(recalls, now) {
  let box = -1
  let due = 0
  let missed = -Infinity
  for (const { right, at } of recalls) {
    // A clock was ahead, so that the true time is unknown: the question is due now.
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

/** Whether another recall changes when its question comes back; if not, it need not be stored. */
export function changesSchedule(recalls, recall) {
  const before = reviewState(recalls, recall.at)
  const after = reviewState([...recalls, recall], recall.at)
  return before?.box !== after?.box || before?.due !== after?.due
}

/**
 * The questions that are due, those of the first boxes first, and how many come later.
 * @template T
 * @param {(T & {recalls: {right: boolean, at: number}[]})[]} answers
 * @returns {{due: (T & {box: number, due: number})[], later: {days: number, count: number}[]}} `later`: counts by days from now
 */
export function agenda(answers, now) {
  const due = []
  const later = new Map()
  for (const answer of answers) {
    const state = reviewState(answer.recalls, now)
    if (state === null) continue
    if (state.due <= now) due.push({ ...answer, box: state.box, due: state.due })
    else {
      const day = Math.ceil((state.due - now) / DAY)
      later.set(day, (later.get(day) ?? 0) + 1)
    }
  }
  due.sort((a, b) => a.box - b.box || a.due - b.due)
  const days = [...later].sort(([a], [b]) => a - b)
  return { due, later: days.map(([days, count]) => ({ days, count })) }
}
