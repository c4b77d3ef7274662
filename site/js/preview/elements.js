/** Parts of the preview's marks and of its panel. */

import { h } from '../lab/page/dom.js'

/** Attributes of messages of the tool, which have no translation. */
export const OF_THE_TOOL = { lang: 'en', dir: 'ltr' }

/** A button that accepts what the preview offers, and beside it the answer. @param {() => Promise<string>} accept promises why it was not, or nothing */
export function offerButton(text, say, accept) {
  const answer = h('span', { class: 'preview-why', role: 'status' })
  const press = async () => {
    button.disabled = true
    answer.textContent = say('written')
    const refusal = await accept()
    if (!refusal) return
    answer.textContent = say('not_written', { reason: refusal })
    button.disabled = false
  }
  const button = h('button', { type: 'button', class: 'preview-accept', onclick: press }, text)
  return [button, ' ', answer]
}

/** What a mistake is: how bad, and the message. */
export const verdict = (say, severity, message) => [h('strong', {}, say(severity)), ' ', h('span', OF_THE_TOOL, ...formatCode(message))]

/** Show text between backticks as code. */
export const formatCode = (text) => text.split(/`([^`]*)`/).map((part, index) => (index % 2 ? h('code', {}, part) : part))
