"""The exact motion that a file beside a model knows: `exact.py FILE`, with a request on one line.

`models/NAME.exact.py` defines `motion(time, qpos, qvel)`: the positions at a time in s, from those
and the velocities at the beginning; with the velocities, too, if it can, as a pair. What is asked
is JSON in the last argument, what is answered JSON on standard output.
"""

import contextlib
import json
import runpy
import sys

import numpy as np


def main(file: str, request: str) -> None:
    """Answer a request: the states at its `times`, begun in its `qpos` and `qvel`."""
    asked = json.loads(request)
    begin = [np.array(asked[name]) for name in ("qpos", "qvel")]
    states = []
    with contextlib.redirect_stdout(sys.stderr):  # what the file prints is no part of the answer
        motion = runpy.run_path(file)["motion"]
        for time in asked["times"]:
            found = motion(time, *(values.copy() for values in begin))
            parts = found if isinstance(found, tuple) else (found,)
            states.append([np.asarray(part, dtype=float).ravel().tolist() for part in parts])
    json.dump(states, sys.stdout)


if __name__ == "__main__":
    main(*sys.argv[1:])
