/**
 * An exercise in its page: an editor, the verdicts of the trials, and a simulation of what the reader has written.
 *
 * The simulation runs in a dedicated worker, as that of a model which readers edit; the trials in one more.
 */

import { Connection, startConfined } from '../lab/page/connection.js'
import { h, textButton } from '../lab/page/dom.js'
import { Editor } from '../lab/page/editor.js'
import { Instrument } from '../lab/page/instrument.js'
import { formatReadout, withUnit } from '../lab/page/numbers.js'
import { sign } from '../progress/signs.js'
import { formulaCode } from './formula.js'

export class Exercise extends Instrument {
  constructor(element, config, base, words, progress) {
    const worker = `${config.worker}#${config.id}` // so that it is dedicated
    super(element, { ...config, worker, kind: 'exercise', exportPython: null }, base, words, progress) // an export would be the solution
    this.leave = progress?.onChange(() => this.showState())
    this.showState()
  }

  build() {
    super.build()
    const { words, config } = this
    const { exercise } = config
    this.controls.element?.remove() // its buttons belong to the trials
    this.loadedText = null
    this.tries = 0
    this.stopJudging = () => {}
    const texts = {
      label: words(`exercise.live.${exercise.subject}`, { names: exercise.names.join(', ') }),
      run: words('exercise.live.check'),
      keys: words('exercise.live.keys_check'),
      back: words('exercise.live.back'),
      mine: words('exercise.live.mine'),
    }
    this.editor = new Editor(exercise.start, words, texts, { run: () => this.check() })
    this.editor.runButton.classList.add('exercise-check')
    this.rows = exercise.trials.map((trial, i) => this.makeRow(trial, i))
    const label = this.element.querySelector('.lab-static [role="group"]')?.getAttribute('aria-label') ?? ''
    this.board = h('ol', { class: 'exercise-trials', 'aria-label': label }, ...this.rows.map(({ element }) => element))
    this.summary = h('p', { class: 'exercise-state', role: 'status' })
    this.editor.element.append(this.summary)
    this.readouts.element.remove() // what trials see stands in their rows
    this.readouts.show = (values) => this.rows.forEach(({ now, trial }, i) => (now.textContent = valueText(values[i], trial)))
    this.body.prepend(this.editor.element, this.board)
  }

  makeRow(trial, i) {
    const { words } = this
    const verdict = h('span', { class: 'exercise-verdict' }, words('exercise.live.waiting'))
    const seen = h('span', { class: 'exercise-seen' })
    const advice = h('p', { class: 'exercise-hint', hidden: true }, trial.hint)
    const watch = textButton(words('exercise.live.watch'), () => this.watch(i), 'lab-text')
    watch.hidden = true
    const now = h('span', { class: 'exercise-now' }, '–') // the value in the picture
    const element = h('li', {}, h('p', {}, h('b', {}, trial.name), ' ', verdict, ' ', seen, ' ', watch), now, advice)
    return { trial, element, verdict, seen, advice, watch, now }
  }

  makeFoot() {
    const foot = super.makeFoot()
    foot.querySelector('button').remove() // a link holds no attempt
    return foot
  }

  // --- judging

  check() {
    const { config, words, editor } = this
    this.stopJudging()
    for (const row of this.rows) this.showVerdict(row, 'waiting')
    this.showState('')
    if (!this.read(editor.text)) return
    this.tries += 1
    this.checkedText = editor.text
    this.showState(words('exercise.live.checking'))
    const results = []
    const next = () => results.length < this.rows.length && this.showVerdict(this.rows[results.length], 'running')
    this.stopJudging = judgeAttempt(this.simulation.addresses, { ...config, attempt: editor.text }, {
      begun: next,
      verdict: (index, verdict) => {
        results.push(verdict.passed)
        this.showVerdict(this.rows[index], verdict.passed ? 'passed' : 'failed', verdict)
        next()
      },
      end: (problem) => this.finish(problem, results),
    }) // prettier-ignore
  }

  /** Say what is wrong with a formula, if anything; returns whether the text can be tried. */
  read(text) {
    const { editor, words, config } = this
    const { exercise } = config
    editor.clear()
    this.notices.clear()
    try {
      if (exercise.subject === 'formula') formulaCode(text, exercise)
      return true
    } catch ({ problem, detail, message }) {
      editor.fail(problem ? words(`exercise.live.formula_${problem}`, { detail, names: exercise.names.join(', ') }) : message)
      return false
    }
  }

  showVerdict({ trial, element, verdict, seen, advice, watch }, state, result = null) {
    const { words } = this
    element.dataset.state = state
    verdict.textContent = words(`exercise.live.${state}`)
    seen.textContent = result === null ? '' : this.seenText(result, trial)
    watch.hidden = result === null
    advice.hidden = state !== 'failed' || trial.hint === ''
  }

  seenText({ seen, failure }, trial) {
    if (seen === null) return this.words('exercise.live.unseen', { message: failure })
    return this.words('exercise.live.seen', { value: valueText(seen, trial) })
  }

  finish(problem, results) {
    const { words, rows, config, element } = this
    for (const row of rows.slice(results.length)) this.showVerdict(row, 'waiting')
    if (problem !== null) this.editor.fail(problem === '' ? words('exercise.live.endless') : problem)
    const passed = results.filter(Boolean).length
    const isSolved = passed === rows.length
    const isJudged = results.length === rows.length
    this.showState(isJudged ? words(isSolved ? 'exercise.live.solved' : 'exercise.live.unsolved', { n: passed, all: rows.length }) : '')
    if (!isSolved) return
    const { id } = config.exercise
    const answer = this.storeDone(id, 'exercise', 'solved', this.tries)
    element.dispatchEvent(new CustomEvent('coursebuild:answered', { bubbles: true, detail: { quiz: id, key: id, answer } }))
  }

  /** Show how far the trials are, or else whether the reader has solved the exercise before. */
  showState(state = this.stateText) {
    this.stateText = state
    const { id } = this.config.exercise
    const isKept = this.hasDone(id)
    const text = state || (isKept ? this.words('exercise.live.kept') : '')
    this.summary.replaceChildren(...(isKept ? [sign('read'), text] : [text]))
  }

  // --- watching

  /** Load a text, if it is not loaded; returns whether it can be tried. */
  load(text) {
    if (this.loadedText === text && this.state !== 'ended') return true
    const { simulation, config } = this
    if (!this.read(text)) return false
    this.loadedText = text
    const model = config.exercise.subject === 'model' ? { xml: text } : {}
    simulation.config = { ...simulation.config, attempt: text, ...model }
    simulation.restart()
    return true
  }

  showPlay(isPlaying) {
    this.transport.setPlaying(isPlaying) // without the name of the trial that Play begins with
  }

  togglePlay() {
    if (this.state === 'playing' || this.state === 'loading' || this.load(this.editor.text)) super.togglePlay()
  }

  /** Show the run of a trial, of the text that was judged. */
  watch(i) {
    const { button, t } = this.config.exercise.trials[i]
    this.load(this.checkedText)
    this.rows.forEach(({ now }, n) => (now.hidden = n !== i))
    this.simulation.replay({ values: this.initial, events: button === null ? [] : [[0, button]], end: t })
    this.body.querySelector('.lab-stage').scrollIntoView({ block: 'nearest' })
  }

  dispose() {
    this.stopJudging()
    this.leave?.()
    super.dispose()
  }
}

/** A value that a trial sees. */
const valueText = (value, { digits, unit }) => withUnit(formatReadout(value, digits).trim(), unit)

/**
 * Has an attempt judged in a worker of its own, which ends with the last verdict, or when it takes too long.
 *
 * @param {{worker: string, module: string, mjb: string, wasm: string}} addresses absolute
 * @param {Record<string, any>} config the lab's data, with `exercise` and `attempt`
 * @param {{begun: () => void, verdict: (index: number, verdict: Record<string, any>) => void, end: (problem: string | null) => void}} on
 *   `end`: after all verdicts; else with what is wrong, which is empty if it took too long
 * @returns {() => void} ends it without a word
 */
function judgeAttempt({ worker, ...addresses }, config, on) {
  const line = new Connection(`${worker}#judge`, startConfined).open(config.id, ({ type, index, message, kind, ...verdict }) => {
    if (type === 'judging') return on.begun()
    if (type === 'verdict') return on.verdict(index, verdict)
    line.close()
    if (type === 'judged') on.end(null)
    else on.end(kind === 'silent' ? '' : message)
  })
  line.send({ type: 'judge', config, ...addresses })
  return line.close
}
