"""Run what a course holds: scripts in processes, formulas in V8, models in MuJoCo.

- `runner`: the lessons' scripts. `workers` are its processes, seen from the tool;
  `script_environment` is the environment of scripts, `sandbox` the one for scripts of strangers,
  started by the program `sandbox_main`, with the filter of `seccomp`, limited by `sandbox_watching`
- inside these processes: `supervisor` (with `watching`) and `script_process`, both in the program
  `worker_main`
- what a script looks at: `tracing` (with `mujoco_tracing`, `mujoco_files`) notes it,
  `trace_records` makes a trace of the notes, `dependencies` what a result depends on
- `memory`: results stored with these (`run_record`), and found again
- `script_environment`, `packages`, `versions`: what results depend on, as it is now;
  `interpreter`: where scripts run, if the map names an environment for them
- `v8` (with `typeset.js`): scripts with limits on time and memory; formulas to MathML
- `mjcf` (with its child `mjcf_worker`): MuJoCo's compiler, and a memory of what it said
- `child`: processes that answer requests
"""
