"""The only I/O: everything else takes values and gives values.

The course's files:

- `place`, `read`: where a course is, and its files as sources
- `examples`, `write`, `locks`: what the tool writes; killing it at any instant loses nothing
- `errors`: what can go wrong with all that

Scripts:

- `runner`: the lessons' scripts. Its processes, seen from it, are in `workers`; what scripts find
  around them is in `surroundings`
- what these processes do: `forkserver` (with `warm`, `interpreter`, `preload`),
  `supervisor` (with `watching`, `required`), `spawned`
- what a script looks at: `tracing` (with `mujoco_tracing`, `mujoco_files`), made dependencies of by
  `notes`
- `dask_runner` (with `dask_task`): the same on a cluster

What is kept:

- `conditions`, `digests`, `packages`, `code`, `tool`: what results depend on, as it is now
- `prepared`: fonts that come cut with the tool

Engines and processes:

- `v8` (with `typeset.js`): scripts with limits on time and memory; formulas to MathML
- `mjcf` (with its child `mjcf_worker`): MuJoCo's compiler
- `lab_engine` (with `lab_pieces.js`), `lab_files`, `native` (with `native_worker`): labs in the
  browser's engine and natively
- `child`: processes that answer
- `exit_immediately`: the end of this process

The preview: `server`, `watch`.

What is installed: `resources`, `versions`.
"""
