"""Evaluate the exact motion that a course gives for a model: `exact.py FILE REQUEST`.

`models/NAME.exact.py` defines `motion(time, qpos, qvel)`: the positions at a time in s, from the
positions and velocities at the beginning; or a pair of positions and velocities.

The request is JSON in the last argument; the answer on standard output is a JSON list of states.
"""

import contextlib
import json
import runpy
import sys

import numpy as np


def answer(file: str, request: str) -> str:
    """Answer a request: the states at its `times`, from its initial `qpos` and `qvel`."""
    query = json.loads(request)
    begin = [np.array(query[name]) for name in ("qpos", "qvel")]
    states = []
    with contextlib.redirect_stdout(sys.stderr):  # what the file prints is no part of the answer
        motion = runpy.run_path(file)["motion"]
        for time in query["times"]:
            result = motion(time, *(values.copy() for values in begin))
            parts = result if isinstance(result, tuple) else (result,)
            states.append([np.asarray(part, dtype=float).ravel().tolist() for part in parts])
    try:
        return json.dumps(states, allow_nan=False)
    except ValueError:
        raise ValueError("a number that it gives is infinite, or not a number") from None


if __name__ == "__main__":
    print(answer(*sys.argv[1:]))
