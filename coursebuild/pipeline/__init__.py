"""The commands, which join the stages.

Entry points: `check`, `build`, `update`, `extract`, `explain`, `export`. Each takes the options,
which name the course's folder, says on a `Progress` what it does, and returns what it found, mostly
as a `Report`.

1. `options`, `progress`: what every command needs
2. `check`: the stages that `check`, `build` and `export` share:
   - `load`: disk → course. A `reader` parses only texts that were not parsed before, and draws
     their pages later; `requests` is what it is asked and what it answers
   - `verify`: course → results, with features' trials, such as those of labs. `scripts` runs
     scripts without a remembered result; `shards` leaves out the work of other machines
   - `judge`: diagnostics → report, and the files that it depends on
3. `build`, with `site` and `downloads`: course and results → the files of a site, or of an export

`coursebuild.preview` does the same in a process that goes on, and draws the open page first.
"""
