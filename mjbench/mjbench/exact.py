"""Evaluate the exact motion that a course gives for a model: `exact.py FILE REQUEST`.

`models/NAME.exact.py` defines one or more of

- `motion(time, qpos, qvel)`: the positions at a time in s, from the positions and velocities at the
  beginning; or a pair of positions and velocities;
- `acceleration(time, qpos, qvel)`, of coordinates whose rates are `qvel`: these equations are
  integrated;
- `expected(qpos, qvel)`: quantities that theory knows, by name.

The request is JSON in the last argument; the answer on standard output is a JSON object with what
there is: the states of `motion` and of `acceleration`, and the quantities of `expected`.
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
    answer: dict[str, Any] = {}
    with contextlib.redirect_stdout(sys.stderr):  # what the file prints is no part of the answer
        names = runpy.run_path(file)
        if "motion" in names:
            states = []
            for time in query["times"]:
                result = names["motion"](time, *(values.copy() for values in begin))
                parts = result if isinstance(result, tuple) else (result,)
                states.append([np.asarray(part, dtype=float).ravel().tolist() for part in parts])
            answer["motion"] = states
        if "acceleration" in names:
            answer["acceleration"] = integrate(names["acceleration"], query["times"], *begin)
        if "expected" in names:
            quantities = names["expected"](*(values.copy() for values in begin))
            answer["expected"] = {name: float(value) for name, value in quantities.items()}
        if not answer:
            raise KeyError("motion")
    try:
        text = json.dumps(answer, allow_nan=False)
    except ValueError:
        raise ValueError("a number that it gives is infinite, or not a number") from None
    print(text)


def integrate(
    acceleration: Callable[..., Any], times: list[float], qpos: np.ndarray, qvel: np.ndarray
) -> list[list[list[float]]]:
    """States at rising times by DOP853, which shares nothing with MuJoCo."""
    from scipy.integrate import solve_ivp

    count = len(qpos)
    if count != len(qvel):  # of a quaternion `qvel` are no rates
        raise ValueError("accelerations are of slides and hinges: for others define `motion`")

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
