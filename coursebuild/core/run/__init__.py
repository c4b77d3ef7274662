"""Runs what a course holds: scripts in processes, formulas in V8, models in MuJoCo.

- `runner`: the lessons' scripts. Its processes, seen from it, are in `workers`; what scripts find
  around them is in `script_environment`, and around those of strangers a `sandbox`
- what these processes do: `supervisor` (with `watching`), `script_process`; both are one program,
  `worker_main`
- what a script looks at: `tracing` (with `mujoco_tracing`, `mujoco_files`), made a trace of by
  `trace_records`, and `dependencies` of that
- `memory`: results that are kept with these (`run_record`), and found again; `model_memory` is the
  same for compiled models
- `script_environment`, `packages`, `versions`: what results depend on, as it is now;
  `interpreter`: where scripts run, if the map names an environment for them
- `v8` (with `typeset.js`): scripts with limits on time and memory; formulas to MathML
- `mjcf` (with its child `mjcf_worker`): MuJoCo's compiler
- `child`: processes that answer
"""
