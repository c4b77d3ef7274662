/** The state that the motion depends on, as numbers: MuJoCo's mjSTATE_INTEGRATION. */

export class State {
  /** @param {import('./engine.js').Engine} engine; @param {import('./engine.js').Handles} handles */
  constructor(engine, handles) {
    this.mj = engine.mj
    this.model = handles.model
    this.data = handles.data
    this.signature = engine.k.state.INTEGRATION
    this.size = this.mj.mj_stateSize(this.model, this.signature)
    this.buffer = handles.adopt(new this.mj.DoubleBuffer(Math.max(1, this.size)))
    this.view = new Float64Array()
  }

  /** A copy of it. */
  read() {
    this.mj.mj_getState(this.model, this.data, this.buffer, this.signature)
    return this.numbers.slice(0, this.size)
  }

  /** The buffer; again if the engine's memory has grown. */
  get numbers() {
    if (this.view.length === 0) this.view = this.buffer.GetView()
    return this.view
  }

  /** Go to it; what is derived from it is not computed. */
  write(numbers) {
    if (numbers.length !== this.size) {
      throw new RangeError(`a state of ${numbers.length} numbers does not fit the model, which has ${this.size}`)
    }
    this.mj.mj_setState(this.model, this.data, Array.from(numbers), this.signature)
  }

  /** The engine's memory. */
  get memory() {
    return this.numbers.buffer
  }

  /** Copy it to another MjData of the model. */
  copy(target) {
    this.mj.mj_copyState(this.model, this.data, target, this.signature)
  }
}
