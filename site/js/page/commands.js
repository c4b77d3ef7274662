/**
 * What can be done from the search dialog besides finding pages. Any part of the page's script may add to it; the
 * dialog, which is loaded when it is first opened, asks for all of them each time.
 */

const commands = new Map()

/**
 * @typedef {object} Command
 * @property {string} id its name; a second one of the same name takes its place
 * @property {string} title as it is shown
 * @property {string} [also] further words that it is found by
 * @property {() => boolean} [when] whether it can be done now
 * @property {() => void | string | Promise<void | string>} run does it; a text is said to the reader
 */

/**
 * Add a command.
 * @param {Command} command
 * @returns {() => void} takes it away again
 */
export function addCommand(command) {
  commands.set(command.id, command)
  return () => {
    if (commands.get(command.id) === command) commands.delete(command.id)
  }
}

/** Those that can be done now, in the order in which they were added. */
export const currentCommands = () => [...commands.values()].filter(({ when }) => when?.() ?? true)
