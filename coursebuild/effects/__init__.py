"""The only I/O: everything else takes values and gives values.

- `read`: the course's files, as sources
- `examples`, `write`, `site_swap`, `locks`: what the tool writes, so that killing it at any instant
  loses nothing
- `runner` (with its child `supervisor`): the lessons' scripts
- `mjcf` (with its child `mjcf_worker`): MuJoCo's compiler
- `v8` (with `typeset.js`): formulas to MathML
- `resources`, `versions`: what is installed
"""
