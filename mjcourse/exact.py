"""Evaluate the exact motion that a course gives for a model: `exact.py FILE REQUEST`.

`models/NAME.exact.py` defines `motion(time, qpos, qvel)`: the positions at a time in s, from the
positions and velocities at the beginning; or a pair of positions and velocities. Or it defines
`acceleration(time, qpos, qvel)`, of coordinates whose rates are `qvel`: these equations are
integrated. The request is JSON in the last argument, the answer JSON on standard output.
"""

import contextlib
import json
import runpy
import sys
from collections.abc import Callable
from typing import Any

import numpy as np


def main(file: str, request: str) -> None:
    """Answer a request: the states at its `times`, from its initial `qpos` and `qvel`."""
    query = json.loads(request)
    begin = [np.array(query[name]) for name in ("qpos", "qvel")]
    states = []
    answer = sys.stdout
    with contextlib.redirect_stdout(sys.stderr):  # what the file prints is no part of the answer
        names = runpy.run_path(file)
        if "acceleration" in names and "motion" not in names:
            json.dump(integrate(names["acceleration"], query["times"], *begin), answer)
            return
        motion = names["motion"]
        for time in query["times"]:
            result = motion(time, *(values.copy() for values in begin))
            parts = result if isinstance(result, tuple) else (result,)
            states.append([np.asarray(part, dtype=float).ravel().tolist() for part in parts])
    json.dump(states, sys.stdout)


def integrate(
    acceleration: Callable[..., Any], times: list[float], qpos: np.ndarray, qvel: np.ndarray
) -> list[list[list[float]]]:
    """States at rising times by DOP853, which shares nothing with MuJoCo."""
    from scipy.integrate import solve_ivp

    count = len(qpos)

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [state[count:], np.ravel(acceleration(time, state[:count], state[count:]))]
        )

    begin, states, now = np.concatenate([qpos, qvel]), [], 0.0
    for time in times:
        if time > now:
            run = solve_ivp(rate, (now, time), begin, "DOP853", rtol=1e-13, atol=1e-13)
            begin, now = run.y[:, -1], time
        states.append([begin[:count].tolist(), begin[count:].tolist()])
    return states


if __name__ == "__main__":
    main(*sys.argv[1:])
