"""Measuring coursebuild beside its peers; the command is `benchmarks/builds.py`.

`tools` says how each is called and configured, `process` times a command, `building` measures
builds, `serving` the time from a save to the page, `running` scripts, `report` makes the tables.
"""
