"""The commands: stages joined with effects.

Entry points: `check`, `build`, `update`, `extract`, `serve`. Each takes the course's root and
options, tells a `Progress` what it does, and gives a `Report`.
"""
