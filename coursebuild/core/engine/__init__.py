"""What is made once and used again, work spread over processes, publishing.

All that is kept from run to run is kept in one way, and these are its words:

- **store**: the results of a course, in `.coursebuild/`; each entry is a file, sealed with the
  user's key (`core.files.trust`).
- **kind, key, group**: the name of an entry, `KIND/KEY` or `KIND/GROUP/KEY`. A key is a hash of all
  that the result depends on, the tool included (`tool.step_key`); a hash of a value alone, without
  its places, is a fingerprint.
- **shared place**: where a store also looks for results of scripts and trials, and sends them;
  these are sealed with the team's key, if there is one. Users know it as the shared cache.
- **run store**: the results of scripts in a store (`core.run.run_store`). What a script reads is
  known only when it has run, so a group has its results, each with the states of what it read.
- **manifest**: what was published where, with keys; an entry of the store.
- **unchanged**: the states of all files when a command last found nothing wrong, also an entry:
  where they are the same, the command ends at once (`cli.unchanged`).
"""
