/**
 * The globals that the engine's glue expects and a bare V8 does not have. Import it first.
 *
 * The glue runs in windows and workers; here it believes to be in a worker. It draws random bytes only for its file system; they
 * are zero here, so that nothing depends on chance.
 */

const globals = /** @type {any} */ (globalThis)
globals.WorkerGlobalScope ??= class WorkerGlobalScope {}
globals.performance ??= { now: () => Date.now() }
globals.crypto ??= { getRandomValues: (view) => view.fill(0) }
