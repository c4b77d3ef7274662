"""The commands: the stages joined.

Entry points: `check`, `build`, `update`, `extract`, `explain`, `serve`, `stability`. Each takes the
course's root and options, tells a `Progress` what it does, and gives what it found, most of them as
a `Report`.

1. `options`, `progress`: what every command needs
2. `load`: disk → course. Its parser is `documents` (with `reading`, `tasks`, `fingerprints`), which
   parses only what nobody has parsed
3. `verify`: course → results. `scripts` runs scripts, by `remember`, which gives what is known;
   `remember_models` compiles models; `trials` tries what features have, as labs; `shards` leaves
   out the parts of other machines
4. `judge`: findings → report, and the files for which it holds
5. `site` (with `pages`, `page_index`): course and results → the files of a site
6. `preview`: the same in memory, for `serve`
"""
