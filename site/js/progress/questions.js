/** Fetches questions from the pages of their lessons. */

import { h } from '../lab/page/dom.js'

/** Pages of the site, each fetched once. */
export class QuestionPages {
  #pages = new Map()

  /**
   * A question that this page can show: alone in its quiz, with its addresses resolved, and with links to the lesson in place of
   * simulations.
   * @param {string} address of the lesson's page
   * @param {string} lab the text of that link
   * @returns {Promise<{section: HTMLElement, question: HTMLElement} | null>} `null` if the page has no such question
   */
  async question(address, quiz, key, lab) {
    const page = await this.#page(address)
    const source = [...page.querySelectorAll('[data-quiz]')].find((section) => section.dataset.quiz === quiz)
    const original = [...(source?.querySelectorAll('[data-question]') ?? [])].find((candidate) => candidate.dataset.question === key)
    if (!original) return null
    const question = document.importNode(original, true)
    resolveAddresses(question, address)
    for (const element of question.querySelectorAll('[data-lab]')) {
      element.replaceWith(h('p', {}, h('a', { href: `${address}#${encodeURIComponent(question.id)}` }, lab)))
    }
    const list = h('ol', { class: 'questions' }, question)
    return { section: h('section', { class: 'quiz', 'data-quiz': quiz }, list), question }
  }

  #page(address) {
    if (!this.#pages.has(address)) this.#pages.set(address, fetchPage(address))
    return this.#pages.get(address)
  }
}

async function fetchPage(address) {
  const response = await fetch(address)
  if (!response.ok) throw new Error(`${response.status}`)
  return new DOMParser().parseFromString(await response.text(), 'text/html')
}

/** Resolve the addresses in a part of another page. */
function resolveAddresses(part, address) {
  for (const name of ['href', 'src', 'data-config', 'data-script']) {
    for (const element of part.querySelectorAll(`[${name}]`)) {
      const value = element.getAttribute(name)
      const inside = value.startsWith('#') && part.querySelector(`#${CSS.escape(value.slice(1))}`)
      if (!inside) element.setAttribute(name, new URL(value, address).href)
    }
  }
}
