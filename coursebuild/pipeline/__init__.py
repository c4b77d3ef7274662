"""The commands: the stages joined.

Entry points: `check`, `build`, `update`, `extract`, `explain`, `serve`, `stability`. Each takes the
course's root and options, tells a `Progress` what it does, and gives what it found, most of them as
a `Report`.

1. `options`, `progress`: what every command needs
2. `load`: disk → course, by `documents` (with `reading`, `tasks`), which
   parses only what nobody has parsed
3. `verify`: course → results, by `remember` and `remember_models`, which give what is known;
   `shards` leaves out the parts of other machines. `labs` (with
   `lab_inputs`, `lab_models`, `lab_export`, `custom_labs`) tries labs
4. `judge`: findings → report; `depends`: the files that it depends on
5. `site` (with `pages`): course and results → the files of a site; `kept`: what is made of the
   tool's own files for that
6. `preview`: the same in memory, for `serve`
"""
