"""`coursebuild serve`: the steps of a build in a process that stays; open pages come first.

Entry point: `serve.serve`.

1. `watcher` tells of changed files, `saves` waits until a save is complete.
2. `session` holds the course: an edited document is read again, and the page that is open is drawn.
3. `rebuild` does behind it what a build does: it reads everything, runs scripts and labs, and puts
   all files of the site together.
4. `server` serves them (`answers`) to those who may ask (`access`); `messages` is what an open
   page is told beside its text, and what its author may accept; `editor` opens a place of it.
"""
