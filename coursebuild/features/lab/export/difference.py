"""Whether an exported script does what the lab does: what a trial recorded beside what it computed.

Entry points: `recorded(run, …)`, which keeps of a trial what is compared; `difference(…)`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from coursebuild.features.lab.reply import MainRun, unpack_arrays

_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
"""How far readouts of the same state may be apart."""


def recorded(run: dict[str, Any], horizon: int) -> dict[str, Any] | None:
    """What is kept of the main run of a trial, as JSON; `None` where no step was made.

    The state is the last one recorded before the step `horizon`, after which a difference in the
    last bit may have grown.
    """
    steps, stride, width = run["steps"], run["stride"], run["width"]
    if steps < stride:
        return None
    row = max(1, min(horizon, steps) // stride)
    states = unpack_arrays(run["states"])
    return {
        "steps": steps,
        "last": int(unpack_arrays(run["checksums"])[-1]),
        "near": row * stride,
        "state": states[(row - 1) * width : row * width].tolist(),
    }


def difference(main: MainRun, run: dict[str, Any], rtol: float) -> str | None:
    """How a script's run differs from the main run of the trial, in words; `None` if it does not.

    The state that was recorded may be apart by `rtol`, relative to its largest number, which counts
    as at least 1. Where the end is the same to the last bit, its readouts are compared, too.
    """
    kept = main["recorded"]
    assert kept is not None, "where nothing was recorded, no script is offered"
    if run["steps"] != kept["steps"]:
        return f"it makes {run['steps']} steps, and the lab {kept['steps']}"
    apart = _apart(run["state"], kept["state"])
    if not apart <= rtol:
        return f"its state after {kept['near']} steps is apart from the lab's by {apart:.1e}"
    first, last = main["pictures"][0], main["pictures"][-1]
    found = _readouts(first["readouts"], run["start"], "start")
    if found is None and run["last"] == kept["last"]:
        found = _readouts(last["readouts"], run["end"], "end")
    return found


def _apart(mine: Sequence[float], theirs: Sequence[float]) -> float:
    if len(mine) != len(theirs):
        return math.inf
    largest = max([1.0, *(abs(x) for x in theirs)])
    return max([0.0, *(abs(a - b) / largest for a, b in zip(mine, theirs, strict=True))])


_INFINITE: dict[Any, str] = {math.inf: "∞", -math.inf: "−∞"}
"""As the trial has them."""


def _readouts(theirs: Any, mine: list[list[Any]], when: str) -> str | None:
    for (label, value), known in zip(mine, theirs or (), strict=False):
        if known is None:  # not a number, which is a gap
            continue
        value = _INFINITE.get(value, value)
        if isinstance(value, str) or isinstance(known, str):
            same = value == known
        else:
            same = math.isclose(value, known, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
        if not same:
            return f"its readout `{label}` is {value} at the {when}, and that of the lab {known}"
    return None
