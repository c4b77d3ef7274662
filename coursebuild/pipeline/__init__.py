"""The commands: the stages joined.

Entry points: `check`, `build`, `update`, `extract`, `explain`, `serve`. Each takes the
course's root and options, tells a `Progress` what it does, and gives what it found, most of them as
a `Report`.

1. `options`, `progress`: what every command needs
2. `check`: the way that `check`, `build` and `export` share, up to the verdict:
   - `load`: disk → course. Its parser is `documents` (with `reading`, `fingerprints`), which parses
     only what nobody has parsed
   - `verify`: course → results. `scripts` runs those of which no result is kept;
     `trials` tries what features have, as labs; `shards` leaves out the parts of other machines
   - `judge`: findings → report, and the files for which it holds
3. `build`, with `site` (and `pages`, `page_index`): course and results → the files of a site

`coursebuild.preview` does the same in a process that stays, with one page drawn first.
"""
