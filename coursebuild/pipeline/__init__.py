"""The commands `check`, `build`, `update`, `extract` and `export`, which join the stages.

Each takes the options, which name the course's folder, says on a `Progress` what it does, and
returns a `Report`: `load` reads the course, `verify` runs it, `check` makes the report, `site` and
`downloads` the files that are published. `coursebuild.preview` does the same in a process that goes
on, and draws the open page first.
"""
