/**
 * `setTimeout` and `clearTimeout`, which pages have and ECMAScript has not.
 *
 * A wait for a word that nobody ever changes ends when its time is over. `timersSet` is a property of the global object on purpose:
 * a timer that a lab sets would ring in the next lab, so that a lab that sets one is found to change what labs share.
 */

'use strict'

var timersSet = 0

{
  /** Actions by the number that `setTimeout` gave for them, until they are taken. */
  const waiting = new Map()

  var setTimeout = (action, milliseconds, ...values) => {
    timersSet += 1
    const number = timersSet
    waiting.set(number, () => action(...values))
    const word = new Int32Array(new SharedArrayBuffer(Int32Array.BYTES_PER_ELEMENT))
    // A wait of no time is over at once, without a promise; as in pages, times are whole numbers of 32 bits.
    const { value: end } = Atomics.waitAsync(word, 0, word[0], Math.max(1, milliseconds | 0))
    end.then(() => {
      const due = waiting.get(number)
      waiting.delete(number)
      due?.()
    })
    return number
  }

  var clearTimeout = (number) => {
    waiting.delete(number)
  }
}
