"""The same curves by other means: NumPy evaluates the formulas, SciPy solves the equations."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.features.lab.equations.formula import ARITIES, Program


def _truth(value: Any) -> Any:
    return (value != 0) & (value == value)


_NUMPY: dict[str, Callable[..., Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.float_power,
    "%": lambda a, b: a - b * np.floor(np.divide(a, b)),
    "neg": np.negative, "not": lambda a: 1.0 - _truth(a),
    "and": lambda a, b: 1.0 * (_truth(a) & _truth(b)),
    "or": lambda a, b: 1.0 * (_truth(a) | _truth(b)),
    "<": lambda a, b: 1.0 * np.less(a, b), "<=": lambda a, b: 1.0 * np.less_equal(a, b),
    ">": lambda a, b: 1.0 * np.greater(a, b), ">=": lambda a, b: 1.0 * np.greater_equal(a, b),
    "==": lambda a, b: 1.0 * np.equal(a, b), "!=": lambda a, b: 1.0 * np.not_equal(a, b),
    "if": lambda test, a, b: np.where(_truth(test), a, b),
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2,
    "asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh,
    "min": np.minimum, "max": np.maximum,
}  # fmt: skip
_COUNTS = {"neg": 1, "not": 1, "if": 3} | ARITIES


def evaluate(program: Program, env: Sequence[Any]) -> Any:
    """Return the value of a program, with NumPy's own functions; it may be infinite or NaN."""
    stack: list[Any] = []
    with np.errstate(all="ignore"):
        for item in program:
            if isinstance(item, list):
                stack.append(env[item[0]])
            elif item == "nan":
                stack.append(np.float64(math.nan))
            elif isinstance(item, str):
                count = _COUNTS.get(item, 2)
                arguments = stack[-count:]
                stack[-count:] = [(_NUMPY.get(item) or getattr(np, item))(*arguments)]
            else:
                stack.append(np.float64(item))
    return stack[0]


class CurveComparison(Struct, frozen=True):
    """How far two computations of a run are apart."""

    difference: float = 0.0
    """The largest, relative to the size of the quantity."""
    name: str = ""
    """The quantity in which it is largest."""
    t: float = 0.0
    problem: str = ""
    """Why they cannot be compared, or what is there in one alone."""


class CurveRun(Struct, frozen=True):
    """A run of the page's own code, sampled; `None` stands for what is not finite."""

    times: list[float]
    states: list[list[float | None]]
    plots: list[dict[str, Any]]
    readouts: list[float | None]
    end: float
    failure: dict[str, Any] | None
    events: list[dict[str, Any]]
    reached: float | None
    longest: float
    claims: list[float | None]


def environment(
    config: dict[str, Any], values: Sequence[float], t: Any, states: Sequence[Any]
) -> list[Any]:
    """The environment of formulas: of one moment, or of many at once."""
    env = [t, *states, *values]
    for program in config["where"]:
        env.append(evaluate(program, env))
    return env


def compare_values(
    config: dict[str, Any], values: Sequence[float], run: CurveRun
) -> CurveComparison:
    """Compare what plots show with NumPy's values of the same formulas."""
    times = np.array(run.times)
    env = environment(config, values, times, [_array(states) for states in run.states])
    worst = CurveComparison()
    for plot, data in zip(config["plots"], run.plots, strict=True):
        for trace, line in zip(plot["traces"], data["traces"], strict=True):
            expected = np.broadcast_to(evaluate(trace["value"], env), times.shape)
            values_shown, is_known = _array(line), np.isfinite(expected)
            if (is_known != np.isfinite(values_shown)).any():
                at = float(times[is_known != np.isfinite(values_shown)][0])
                return CurveComparison(math.inf, trace["label"], at, "has a value in one alone")
            if not is_known.any():
                continue
            size = np.abs(expected[is_known]) + np.median(np.abs(expected[is_known])) + 1e-300
            difference = np.abs(values_shown - expected)[is_known] / size
            if (largest := float(difference.max())) > worst.difference:
                at = float(times[is_known][int(difference.argmax())])
                worst = CurveComparison(largest, trace["label"], at)
    return worst


_MOST_EVALUATIONS = 300_000
"""Of the equations of one run; it takes a few thousand where they are harmless."""


class _TooLongError(Exception):
    """SciPy evaluated the equations too often."""


class _Equations:
    def __init__(self, config: dict[str, Any], values: Sequence[float], end: float) -> None:
        """`end`: the processor time of this thread at which patience ends, s."""
        self.config, self.values, self.count, self.end = config, values, 0, end
        self.before: tuple[int, float] | None = None
        """The event that has just been, and the value of its quantity then."""

    def rates(self, t: float, y: Sequence[float]) -> list[float]:
        self.count += 1
        if self.count > _MOST_EVALUATIONS or time.thread_time() > self.end:
            raise _TooLongError
        env = environment(self.config, self.values, t, y)
        return [float(evaluate(state["rate"], env)) for state in self.config["states"]]

    def solve(
        self, t: float, end: float, y: list[float], sizes: NDArray[np.float64], length: float
    ) -> Any:
        """SciPy's solution to an end or an event, expected after `length`; or why there is none."""
        from scipy.integrate import solve_ivp

        try:
            events = [self.event(i, t, y, end - t) for i in range(len(self.config["events"]))]
            with np.errstate(all="ignore"):
                solution = solve_ivp(
                    self.rates, (t, end), y, method="DOP853", rtol=1e-11, atol=1e-13 * sizes,
                    dense_output=True, events=events or None,
                    max_step=length / 8 if events else np.inf,
                )  # fmt: skip
        except _TooLongError:
            return "SciPy needs too many steps"
        return solution if solution.success else f"SciPy says: {solution.message}"

    def quantity(self, index: int, t: float, y: Sequence[float]) -> float:
        """The quantity whose zero an event is."""
        env = environment(self.config, self.values, t, y)
        return float(evaluate(self.config["events"][index]["when"], env))

    def event(self, index: int, start: float, y: list[float], length: float) -> Any:
        """The quantity of an event for SciPy, in a solution that begins here.

        Right after the event, and at some starts, it is 0 but for rounding; then it stands where it
        moves, as in the page.
        """
        direction = self.config["events"][index]["direction"]
        first = self.quantity(index, start, y)
        is_latest = self.before is not None and self.before[0] == index
        if is_latest or first == 0:
            before = self.before[1] if is_latest and self.before is not None else 0.0
            delta = 1e-7 * length
            neighbour = [a + delta * b for a, b in zip(y, self.rates(start, y), strict=True)]
            change = self.quantity(index, start + delta, neighbour) - first
            if abs(first) <= 10 * abs(before) + abs(change):
                first = float(np.sign(change)) or float(-direction)

        def quantity(t: float, y: Sequence[float]) -> float:
            return first if t <= start else self.quantity(index, t, y)

        quantity.terminal = True  # type: ignore[attr-defined]
        quantity.direction = direction  # type: ignore[attr-defined]
        return quantity

    def assign(self, index: int, t: float, y: list[float]) -> list[float]:
        self.before = index, self.quantity(index, t, y)
        env = environment(self.config, self.values, t, y)
        after = list(y)
        for slot, program in self.config["events"][index]["set"]:
            after[slot - 1] = float(evaluate(program, env))
        return after


def compare_states(
    config: dict[str, Any], values: Sequence[float], run: CurveRun, until: float, patience: float
) -> CurveComparison:
    """Compare the states with SciPy's solution, event by event, up to a place on the axis.

    The first difference above the lab's tolerance ends it: from there on small ones may have grown
    to any size, another one on each machine.

    `patience`: the processor time of this thread at which it is given up, s.
    """
    equations, times = _Equations(config, values, patience), np.array(run.times)
    columns = np.array([_array(states) for states in run.states])
    sizes = np.abs(columns).max(axis=1) + 1e-300
    t, most = config["axis"]["min"], config["axis"]["max"]
    env = environment(config, values, t, [0.0] * len(sizes))
    y = [float(evaluate(state["start"], env)) for state in config["states"]]
    close, worst, first = 1e-6 * (most - t), CurveComparison(), 0
    # A sample stands on either side of each event.
    cuts = [i + 1 for i, (a, b) in enumerate(pairwise(run.times)) if a == b]
    for k, last in enumerate([*cuts, len(times)]):
        if t >= until:
            break
        computed, index, stop = np.array(y)[:, None], None, t
        if run.end - t > 1e-3 * close:  # otherwise an event has ended the run
            event: dict[str, Any] = run.events[k] if k < len(run.events) else {"t": run.end}
            end, index = event["t"], event.get("index")
            limit = end if index is None else min(end + 0.05 * (end - t), most)
            solution = equations.solve(t, max(limit, t), y, sizes, end - t)
            if isinstance(solution, str):
                return CurveComparison(math.inf, "", t, solution)
            event_index = next((i for i, at in enumerate(solution.t_events or ()) if len(at)), None)
            stop = float(solution.t[-1])
            if event_index != index or abs(stop - end) > close:
                names = [
                    "no event" if i is None else f"event {i + 1}" for i in (index, event_index)
                ]
                problem = f"there is {names[0]} at {end:.9g}, and {names[1]} at {stop:.9g}"
                return CurveComparison(math.inf, "", end, problem)
            computed = solution.sol(np.clip(times[first:last], t, stop))
            y = solution.y[:, -1].tolist()
        difference = np.abs(computed - columns[:, first:last]) / sizes[:, None]
        difference[:, times[first:last] > until] = 0
        if difference.size and difference.max() > worst.difference:
            too_large = (difference > config["verify"]["rtol"]).any(axis=0)
            at = int(too_large.argmax() if too_large.any() else difference.max(axis=0).argmax())
            state = int(difference[:, at].argmax())
            name = config["states"][state]["name"]
            worst = CurveComparison(float(difference[state, at]), name, float(times[first + at]))
            if too_large.any():
                return worst
        t, first = stop, last
        if index is not None:
            y = equations.assign(index, t, y)
    return worst


def _array(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([math.nan if value is None else value for value in values], float)
