"""Run what a course holds: scripts in processes, formulas in V8, models in MuJoCo.

- `script_server`: the lessons' scripts. `script_worker` are its processes, seen from the tool, and
  what their sandboxes take; `sandbox` is that of scripts of strangers, started by the program
  `sandbox_main`, with the filter of `seccomp`
- inside these processes: `supervisor` (with `watching`) and `script_process`, both in the program
  `script_main`
- what a script looks at: `tracing` (with `mujoco_tracing`, `mujoco_files`) notes it, `run_record`
  makes a trace and what is stored of the notes, `dependencies` what a result depends on
- `run_store`: results stored with these, and found again
- `script_environment`, `packages`: where scripts run, and what results depend on, as it is now
- `v8` (with `typeset.js`): scripts with limits on time and memory; formulas to MathML
- `mjcf` (with its child `compile_main`): MuJoCo's compiler, and a memory of what it said
- `child`: processes that answer requests
"""
