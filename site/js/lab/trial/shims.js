/**
 * What the engine's glue expects of its surroundings and a bare V8 does not have. Import it first.
 *
 * The glue runs in windows and workers: it is told that this is a worker. It draws random bytes for its file system only; they
 * are zero here, so that nothing depends on chance.
 */

globalThis.WorkerGlobalScope ??= class WorkerGlobalScope {}
globalThis.performance ??= { now: () => Date.now() }
globalThis.crypto ??= { getRandomValues: (view) => view.fill(0) }
