/**
 * A learning platform's API of SCORM 1.2, as strict as the standard: it takes nothing that the data model does not have, no value that
 * is not in an element's vocabulary or format, nothing before the beginning and nothing after the end (Run-Time Environment 1.2,
 * sections 3.3 and 3.4; error codes: 3.3.5).
 */

const DECIMAL = /^-?(\d+|\d+\.\d+|\.\d+)$/
const TIMESPAN = /^\d{2,4}:[0-5]\d:[0-5]\d(\.\d{1,2})?$/
const TIME = /^([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d{1,2})?$/
const isShort = (value) => value.length <= 255
const isPoints = (value) => value === '' || (DECIMAL.test(value) && Number(value) >= 0 && Number(value) <= 100)
const isSign = (value) => /^[a-z0-9]$/.test(value)
const isIdentifier = (value) => value.length > 0 && value.length <= 255 && /^[\u0021-\u007e]+$/.test(value)

const TYPES = ['true-false', 'choice', 'fill-in', 'matching', 'performance', 'sequencing', 'likert', 'numeric']
const RESPONSES = {
  choice: (value) => value.split(',').every(isSign),
  sequencing: (value) => value.split(',').every(isSign),
  numeric: (value) => DECIMAL.test(value),
  'fill-in': isShort,
}

/** What may be set, and what it may be. */
const SETTABLE = {
  'cmi.core.lesson_location': isShort,
  'cmi.core.lesson_status': (value) => ['passed', 'completed', 'failed', 'incomplete', 'browsed'].includes(value),
  'cmi.core.score.raw': isPoints,
  'cmi.core.score.min': isPoints,
  'cmi.core.score.max': isPoints,
  'cmi.core.exit': (value) => ['time-out', 'suspend', 'logout', ''].includes(value),
  'cmi.core.session_time': (value) => TIMESPAN.test(value),
  'cmi.suspend_data': (value) => value.length <= 4096,
}
const INTERACTION = {
  id: isIdentifier,
  type: (value) => TYPES.includes(value),
  time: (value) => TIME.test(value),
  'correct_responses.0.pattern': (value, { type }) => RESPONSES[type]?.(value) ?? false,
  student_response: (value, { type }) => RESPONSES[type]?.(value) ?? false,
  weighting: (value) => DECIMAL.test(value),
  result: (value) => ['correct', 'wrong', 'unanticipated', 'neutral'].includes(value) || DECIMAL.test(value),
  latency: (value) => TIMESPAN.test(value),
}
const READ_ONLY = {
  'cmi.core.student_id': 'learner-7',
  'cmi.core.student_name': 'Noether, Emmy',
  'cmi.core.credit': 'credit',
  'cmi.core.entry': 'ab-initio',
  'cmi.core.lesson_mode': 'normal',
  'cmi.launch_data': '',
  'cmi.core.score._children': 'raw,min,max',
  'cmi.interactions._children': 'id,objectives,time,type,correct_responses,weighting,student_response,result,latency',
}

export class StrictApi {
  state = 'new'
  error = '0'
  commits = 0
  errors = []
  interactions = []
  calls = []

  constructor(values = {}) {
    this.values = { ...READ_ONLY, 'cmi.core.lesson_status': 'not attempted', 'cmi.suspend_data': '', 'cmi.core.lesson_location': '', ...values }
  }

  LMSInitialize(nothing) {
    return this.#said('LMSInitialize', [nothing], () => {
      if (nothing !== '') return '201'
      if (this.state !== 'new') return '101'
      this.state = 'running'
      return '0'
    })
  }

  LMSFinish(nothing) {
    return this.#said('LMSFinish', [nothing], () => {
      if (nothing !== '') return '201'
      if (this.state !== 'running') return '301'
      this.state = 'over'
      return '0'
    })
  }

  LMSCommit(nothing) {
    return this.#said('LMSCommit', [nothing], () => {
      if (nothing !== '') return '201'
      if (this.state !== 'running') return '301'
      this.commits += 1
      return '0'
    })
  }

  LMSGetValue(name) {
    let value = ''
    this.#said('LMSGetValue', [name], () => {
      if (this.state !== 'running') return '301'
      if (name === 'cmi.interactions._count' && this.values['cmi.interactions._children'] === '') return '401'
      if (name.endsWith('._children') && this.values[name] === '') return '401'
      if (name === 'cmi.interactions._count') value = String(this.interactions.length)
      else if (Object.hasOwn(this.values, name)) value = this.values[name]
      else return name.startsWith('cmi.interactions.') || name === 'cmi.core.exit' || name === 'cmi.core.session_time' ? '404' : '401'
      return '0'
    })
    return value
  }

  LMSSetValue(name, value) {
    return this.#said('LMSSetValue', [name, value], () => {
      if (this.state !== 'running') return '301'
      if (typeof value !== 'string') return '405'
      if (Object.hasOwn(READ_ONLY, name)) return '403'
      if (name.startsWith('cmi.interactions.')) return this.#setInteraction(name, value)
      if (!Object.hasOwn(SETTABLE, name) || this.#lacks(name)) return '401'
      if (!SETTABLE[name](value)) return '405'
      this.values[name] = value
      return '0'
    })
  }

  /** What is optional, and not listed. */
  #lacks(name) {
    const [, group, part] = /^(cmi\.core\.score|cmi\.interactions)\.(?:\d+\.)?(\w+)/.exec(name) ?? []
    return group !== undefined && !this.values[`${group}._children`].split(',').includes(part)
  }

  #setInteraction(name, value) {
    if (this.#lacks(name)) return '401'
    const [, at, part] = /^cmi\.interactions\.(\d+)\.(.+)$/.exec(name) ?? []
    if (part === undefined || !Object.hasOwn(INTERACTION, part)) return '401'
    if (Number(at) > this.interactions.length) return '201'
    const known = this.interactions[Number(at)]
    if (!known && part !== 'id') return '201' // what it is about comes first
    const about = known ?? {}
    if (!INTERACTION[part](value, about)) return '405'
    about[part] = value
    if (!known) this.interactions.push(about)
    return '0'
  }

  LMSGetLastError() {
    return this.error
  }

  LMSGetErrorString(code) {
    return code === '0' ? '' : `error ${code}`
  }

  LMSGetDiagnostic() {
    return ''
  }

  #said(name, given, act) {
    this.calls.push([name, ...given])
    this.error = act()
    if (this.error !== '0') this.errors.push([this.error, name, ...given])
    return String(this.error === '0')
  }
}
