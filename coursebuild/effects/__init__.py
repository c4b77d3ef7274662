"""The only I/O: everything else takes values and gives values.

- `read`: the course's files, as sources
- `examples`, `write`, `site_swap`, `locks`: what the tool writes, so that killing it at any instant
  loses nothing
- `runner`: the lessons' scripts. Its processes, seen from it, are in `workers`; what they do is in
  `forkserver` (with `warm`, `interpreter`, `preload`, `ending`), `supervisor` (with `watching`,
  `required`), `tracing` (with `mujoco_tracing`, `mujoco_files`, `spawned`, `notes`); what scripts
  find around them is in `surroundings`
- `mjcf` (with its child `mjcf_worker`): MuJoCo's compiler
- `v8` (with `typeset.js`): formulas to MathML
- `resources`, `versions`: what is installed
"""
