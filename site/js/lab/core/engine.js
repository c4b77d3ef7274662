/**
 * MuJoCo's WebAssembly build, and the models that it holds.
 *
 *   createEngine(loadMujoco, module) → Promise<Engine>
 *   engine.load(model)               → Handles
 *
 * The bindings hand out C++ objects that JavaScript does not collect. Here each has one owner, who deletes it once:
 * `Handles` owns a model with its data, and whoever calls `load` owns the handles. `model.opt`, `data.warning` and the like
 * are references into these two, which must not be deleted.
 */

/** The engine cannot be used, or cannot use a model. `fatal`: no further call will work either. */
export class EngineError extends Error {
  constructor(message, fatal = false) {
    super(message)
    this.name = 'EngineError'
    this.kind = 'load'
    this.fatal = fatal
  }
}

/**
 * Start the engine.
 *
 * It is compiled beforehand, for the glue goes on waiting for a module that does not come.
 *
 * @param {(module: object) => Promise<object>} loadMujoco the default export of @mujoco/mujoco
 * @param {WebAssembly.Module} module mujoco.wasm
 * @param {(text: string) => void} [log] what the engine prints
 * @returns {Promise<Engine>}
 */
export async function createEngine(loadMujoco, module, log = () => {}) {
  try {
    const mj = await loadMujoco({
      print: log,
      printErr: log,
      instantiateWasm(imports, done) {
        const started = readableBooleans(imports.env)
        const instance = new WebAssembly.Instance(module, imports)
        started(instance)
        done(instance, module)
      },
    })
    return new Engine(mj)
  } catch (error) {
    throw new EngineError(`the engine does not start: ${error.message ?? error}`, true)
  }
}

/**
 * Arrays of booleans (`data.eq_active`, `model.light_active`, …) have a type that the bindings forget to register, so that
 * reading one throws. It is registered here, as bytes, when it is first met.
 *
 * @param {object} env the functions that the engine imports; one is replaced
 * @returns {(instance: WebAssembly.Instance) => void} to be called with the instance
 */
function readableBooleans(env) {
  const take = env._emval_take_value
  let memory = null
  let known = false
  const UNSIGNED_BYTES = 1
  env._emval_take_value = (type, argument) => {
    if (known) return take(type, argument)
    try {
      return take(type, argument)
    } catch (error) {
      // A C++ type_info: a pointer to its methods, then one to its name.
      const name = new Uint32Array(memory.buffer)[(type >> 2) + 1]
      if (textAt(memory, name) !== 'N10emscripten11memory_viewIbEE') throw error
      env._embind_register_memory_view(type, UNSIGNED_BYTES, name)
      known = true
      return take(type, argument)
    }
  }
  return (instance) => (memory = instance.exports.memory)
}

function textAt(memory, address) {
  const bytes = new Uint8Array(memory.buffer)
  return String.fromCharCode(...bytes.subarray(address, bytes.indexOf(0, address)))
}

/** A running engine: `mj` are the bindings, `version` is MuJoCo's, `k` the numbers of its enumerations. */
export class Engine {
  constructor(mj) {
    this.mj = mj
    this.version = mj.mj_versionString()
    this.k = constants(mj)
  }

  /**
   * Load a model.
   *
   * @param {Uint8Array | string} model an MJB file of the same engine version, or MJCF
   * @returns {Handles}
   */
  load(model) {
    return new Handles(this.mj, model)
  }
}

/** A model, its data, and a second data for looking at (see `lab.js`). */
export class Handles {
  constructor(mj, model) {
    this.model = typeof model === 'string' ? compileModel(mj, model) : readModel(mj, model)
    this.owned = [this.model]
    try {
      this.data = this.own(new mj.MjData(this.model))
      this.shown = this.own(new mj.MjData(this.model))
    } catch (error) {
      this.dispose()
      throw new EngineError(`the model has no room: ${error.message}`)
    }
  }

  /** Take over a C++ object: it is deleted with the model. */
  own(object) {
    this.owned.push(object)
    return object
  }

  /** Delete everything, last made first; a second call does nothing. */
  dispose() {
    for (const object of this.owned.splice(0).reverse()) object.delete()
  }
}

const PATH = '/model.mjb'

function readModel(mj, bytes) {
  // MjVFS.addBuffer takes a microsecond for each four bytes; the engine's own file system copies them at once. A name that
  // the MjVFS does not hold is looked for there.
  const files = new mj.MjVFS()
  let model = null
  try {
    mj.FS.writeFile(PATH, bytes)
    model = mj.MjModel.from_binary_path(PATH, files)
  } catch (error) {
    const reason = String(error.message).replace(/^MuJoCo Error: /, '')
    throw new EngineError(`the model does not load: ${reason}`, error instanceof WebAssembly.RuntimeError)
  } finally {
    mj.FS.unlink(PATH)
    files.delete()
  }
  if (model === null || model === undefined) throw new EngineError('the model does not load')
  return model
}

/** How much of what a page has to draw it draws without becoming slow. */
const MOST = { ngeom: 2000, nsite: 2000, nlight: 100, nmeshface: 200_000, nhfielddata: 500_000, ntexdata: 64 << 20 }

/** Compile MJCF that a reader may have written. It lies in no folder: a file that it names is not found. */
function compileModel(mj, text) {
  const model = compiled(mj, text)
  const beyond = Object.keys(MOST).find((name) => model[name] > MOST[name])
  if (beyond === undefined) return model
  const has = model[beyond]
  model.delete()
  throw new EngineError(`${beyond} is ${has}, and a page shows models up to ${MOST[beyond]}`)
}

function compiled(mj, text) {
  try {
    return mj.MjModel.from_xml_string(text)
  } catch (error) {
    const message = String(error.message).trim()
    const told = message.replace(/^MuJoCo Error: (Loading error: )?/, '')
    // What is thrown by C++ itself, for lack of memory, has only the name of what it wanted to make.
    const reason = told === message ? `the engine has no room for this model (${message})` : told
    throw new EngineError(reason, error instanceof WebAssembly.RuntimeError)
  }
}

/** The numbers of the enumerators that the lab needs: `k.obj.BODY`, `k.vis.COM`, `k.state.INTEGRATION`, … */
function constants(mj) {
  const numbers = (type, prefix) =>
    Object.fromEntries(
      Object.keys(type)
        .filter((name) => name.startsWith(prefix))
        .map((name) => [name.slice(prefix.length), type[name].value]),
    )
  return Object.freeze({
    obj: numbers(mj.mjtObj, 'mjOBJ_'),
    joint: numbers(mj.mjtJoint, 'mjJNT_'),
    geom: numbers(mj.mjtGeom, 'mjGEOM_'),
    vis: numbers(mj.mjtVisFlag, 'mjVIS_'),
    frame: numbers(mj.mjtFrame, 'mjFRAME_'),
    category: numbers(mj.mjtCatBit, 'mjCAT_'),
    state: numbers(mj.mjtState, 'mjSTATE_'),
    disable: numbers(mj.mjtDisableBit, 'mjDSBL_'),
    warning: numbers(mj.mjtWarning, 'mjWARN_'),
    perturb: numbers(mj.mjtPertBit, 'mjPERT_'),
  })
}
