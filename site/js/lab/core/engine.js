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
 * The module is compiled beforehand: if its own compilation failed, the glue would wait forever.
 *
 * @param {(module: Record<string, any>) => Promise<Record<string, any>>} loadMujoco the default export of @mujoco/mujoco
 * @param {WebAssembly.Module} module mujoco.wasm
 * @param {(text: string) => void} [log] what the engine prints
 * @returns {Promise<Engine>}
 */
export async function createEngine(loadMujoco, module, log = () => {}) {
  try {
    const mj = await loadMujoco({
      print: log,
      printErr: log,
      instantiateWasm(imports, finish) {
        const onInstance = registerBooleanViews(imports.env)
        const instance = new WebAssembly.Instance(module, imports)
        onInstance(instance)
        finish(instance, module)
      },
    })
    return new Engine(mj)
  } catch (error) {
    throw new EngineError(`the engine does not start: ${error.message ?? error}`, true)
  }
}

/**
 * Arrays of booleans (`data.eq_active`, `model.light_active`, …) have a type that the bindings forget to register, so that
 * reading one throws. The type is registered here, as bytes, on the first such read.
 *
 * @param {Record<string, any>} env the functions that the engine imports; one is replaced
 * @returns {(instance: WebAssembly.Instance) => void} to be called with the instance
 */
function registerBooleanViews(env) {
  const take = env._emval_take_value
  let memory = null
  let isRegistered = false
  const UNSIGNED_BYTES = 1
  env._emval_take_value = (type, argument) => {
    if (isRegistered) return take(type, argument)
    try {
      return take(type, argument)
    } catch (error) {
      // A C++ type_info: a pointer to its methods, then one to its name.
      const name = new Uint32Array(memory.buffer)[(type >> 2) + 1]
      if (textAt(memory, name) !== 'N10emscripten11memory_viewIbEE') throw error
      env._embind_register_memory_view(type, UNSIGNED_BYTES, name)
      isRegistered = true
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
   * @param {{main: string, files: Map<string, Uint8Array>} | null} [own] of MJCF, the path of its file and the files that it may name
   * @returns {Handles}
   */
  load(model, own = null) {
    return new Handles(this.mj, model, own)
  }
}

const LEAST = 1 << 20 // bytes that any model reserves

/** A model, its data, and a second data that is only looked at (see `lab.js`). */
export class Handles {
  constructor(mj, model, own) {
    this.model = typeof model === 'string' ? compileModel(mj, model, own) : readModel(mj, model)
    this.objects = [this.model]
    while (true) {
      try {
        this.data = this.adopt(new mj.MjData(this.model))
        this.displayData = this.adopt(new mj.MjData(this.model))
        return
      } catch (error) {
        // What a model reserves for contacts and constraints it hardly ever uses; the engine warns if it is full.
        const half = Math.floor(this.model.narena / 2)
        this.dispose(half < LEAST ? 0 : 1)
        if (half < LEAST) throw new EngineError(`the model has no room: ${error.message}`)
        this.model.narena = half
      }
    }
  }

  /** Take over a C++ object: it is deleted with the model. */
  adopt(object) {
    this.objects.push(object)
    return object
  }

  /** Delete everything but the first so many, last made first; a second call does nothing. */
  dispose(kept = 0) {
    for (const object of this.objects.splice(kept).reverse()) object.delete()
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

/** The largest model that a page draws without becoming slow, and what a browser has room for; meshes and textures are drawn coarser (core/detail.js). */
const MOST = { ngeom: 2000, nsite: 2000, nlight: 100, nmeshface: 4_000_000, nhfielddata: 500_000, ntexdata: 512 << 20 }

const RESERVE = /(<size\b[^<>]*?)\bmemory\s*=\s*(["'])[^"'<>]*\2/g

/** Compile MJCF that a reader may have written, and refuse a model that is too large to draw. Of files it finds its own only. */
function compileModel(mj, text, own) {
  const model = compileReserving(mj, text, own)
  const field = Object.keys(MOST).find((name) => model[name] > MOST[name])
  if (field === undefined) return model
  const size = model[field]
  model.delete()
  throw new EngineError(`${field} is ${size}, and a page shows models up to ${MOST[field]}`)
}

/** Compile a model; where there is no room for what its text reserves, it reserves what MuJoCo thinks best. */
function compileReserving(mj, text, own) {
  try {
    return compileXml(mj, text, own)
  } catch (error) {
    if (error.fatal || !/no room|allocate memory|is too big/.test(error.message)) throw error
    const files = own && new Map([...own.files].map(([path, bytes]) => [path, /\.xml$/i.test(path) ? withoutReserve(bytes) : bytes]))
    return compileXml(mj, text.replace(RESERVE, '$1'), own && { ...own, files })
  }
}

const withoutReserve = (bytes) => new TextEncoder().encode(new TextDecoder().decode(bytes).replace(RESERVE, '$1'))

const FOLDER = '/own'

/** Write files into the engine's own file system; returns their paths there. */
function writeFiles({ FS }, files) {
  return [...files].map(([name, content]) => {
    const path = `${FOLDER}/${name}`
    FS.mkdirTree(path.slice(0, path.lastIndexOf('/')))
    FS.writeFile(path, content)
    return path
  })
}

function compileXml(mj, text, own) {
  let paths = []
  try {
    if (own === null) return mj.MjModel.from_xml_string(text)
    paths = writeFiles(mj, new Map(own.files).set(own.main, text))
    return mj.MjModel.from_xml_path(`${FOLDER}/${own.main}`)
  } catch (error) {
    const message = String(error.message).trim()
    const detail = message.replace(/^MuJoCo Error: (Loading error: )?/, '')
    // An exception of C++ itself, for lack of memory, holds only the name of a type.
    const reason = detail === message ? `the engine has no room for this model (${message})` : detail
    throw new EngineError(reason, error instanceof WebAssembly.RuntimeError)
  } finally {
    for (const path of paths) mj.FS.unlink(path)
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
