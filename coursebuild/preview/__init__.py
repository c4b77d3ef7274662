"""`coursebuild serve`: a build in a process that goes on, which draws open pages first.

Entry point: `serve.serve`.

1. `watcher` reports changed files, `live_course` waits until a save is complete.
2. `session` holds the course: an edited document is read again, and the open page is drawn.
3. `rebuild` does in the background what a build does: it reads everything, runs scripts and labs,
   and makes all files of the site.
4. `server` serves them (`answers`) to those who may ask (`access`). `messages` tells an open page
   what is wrong and what its author may accept.
"""
