/**
 * Doing something later, in a worker.
 *
 * A timer that a timer has set waits for 4 ms at least, whatever it is asked for: a lab that cannot keep up would lose a
 * quarter of its time. What has not to wait comes as a message instead, behind the messages that are there already.
 *
 * @param {MessageChannel} [channel]
 * @returns {(action: () => void, ms: number) => void}
 */
export function createLater(channel = new MessageChannel()) {
  const actions = []
  channel.port1.onmessage = () => actions.shift()()
  return (action, ms) => {
    if (ms > 0) return void setTimeout(action, ms)
    actions.push(action)
    channel.port2.postMessage(null)
  }
}
