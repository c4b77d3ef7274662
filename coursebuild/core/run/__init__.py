"""Run what a course holds: scripts in processes, formulas in QuickJS, labs in V8, models in MuJoCo.

`script_server` starts `script_worker`s, whose program is `script_main` (`supervisor` with
`watching`, then `script_process`), perhaps in a `sandbox`; `tracing` notes what a script looks at,
`run_record` and `dependencies` make what is stored of it, `run_store` finds it again.
"""
