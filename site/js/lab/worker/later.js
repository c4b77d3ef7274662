/**
 * A `setTimeout` without its shortest delay, for a worker.
 *
 * A timer that was set by a timer waits for at least 4 ms: a lab that cannot keep up would lose a quarter of its time. An action
 * that need not wait is posted as a message instead, behind the messages that are already queued.
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
