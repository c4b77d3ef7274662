"""Integration for references: of differential equations by two methods, and of functions.

Entry points: `bulirsch_stoer(rate, start, times, tolerance)` and `dop853(rate, start, times)` of
scipy, which share nothing, so that the two together say how well a motion is known;
`cumulative_integral(function, times, width)`.

*Bulirsch–Stoer*: Gragg's midpoint rule, extrapolated.

1. A step of length H is made by the modified midpoint rule with 2, 4, …, 2k substeps; its error has
   only even powers of the substep, so that Neville's scheme removes them one by one (order 2k).
2. The difference of the last two columns is the error estimate; H follows it.
3. The given times are always ends of steps, so that nothing is interpolated.

The state may be of any numbers that numpy adds and multiplies: float64, or `decimal.Decimal` in an
object array for a reference with more digits.

Sources: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, II.5
and II.9; P. J. Davis, P. Rabinowitz, Methods of Numerical Integration, 2.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coursebuild.numerics.problem import Array

State = NDArray[Any]
"""(d,) float64, or objects of `Decimal`."""
Rate = Callable[[State], State]
"""dy/dt of an autonomous system."""

_SHRINK, _GROW, _SAFETY = 0.2, 2.5, 0.85


class NoConvergenceError(ArithmeticError):
    """The step became too small: the problem is not smooth there."""


def bulirsch_stoer(
    rate: Rate,
    start: State,
    times: NDArray[np.float64],
    tolerance: float = 1e-14,
    *,
    columns: int = 8,
    first: float = 1e-2,
) -> State:
    """The states (n, d) at the times (n,), which rise; `start` (d,) is the state at time 0.

    `tolerance` bounds the estimated error of a step, relative to 1 + |y| in each component;
    `columns` is half the order; `first` the first step tried, in seconds.

    Raises:
        NoConvergenceError: no step is small enough.
    """
    exact = start.dtype == object
    y, now, trial = start.copy(), Decimal(0) if exact else 0.0, first
    carry = np.zeros_like(y)
    states = []
    for time in times.tolist():
        goal: Any = Decimal(time) if exact else time
        while now < goal:
            left = float(goal - now)
            whole = trial >= left * (1 - 1e-12)
            step: Any = goal - now if whole else (Decimal(trial) if exact else trial)
            change, error = _extrapolate(rate, y, step, columns)
            ratio = error / tolerance
            if not ratio <= 1.0:  # also when it is no number
                factor = _SAFETY * ratio ** (-1 / (2 * columns - 1)) if ratio < 1e300 else _SHRINK
                trial = float(step) * max(_SHRINK, min(factor, 0.9))
                if trial < 1e-12 * first:
                    raise NoConvergenceError(f"no step is small enough at {float(now):.6g} s")
                continue
            change = change - carry  # Kahan's sum: many small steps must not add up roundings
            total = y + change
            y, carry = total, (total - y) - change
            now = goal if whole else now + step
            next_trial = float(step) * min(
                _GROW, _SAFETY * max(ratio, 1e-12) ** (-1 / (2 * columns))
            )
            trial = max(trial, next_trial) if whole else next_trial
        states.append(y.copy())
    return np.array(states)


def _extrapolate(rate: Rate, y: State, step: Any, columns: int) -> tuple[State, float]:
    """The change of y over a step, and its estimated error relative to 1 + |y|."""
    with np.errstate(over="ignore", invalid="ignore"):  # a step too long is made again
        slope = rate(y)
        rows: list[State] = []
        for j in range(1, columns + 1):
            new = [_midpoint(rate, y, slope, step, 2 * j)]
            for k in range(1, j):
                fine, coarse = j * j, (j - k) * (j - k)
                new.append(new[-1] + (new[-1] - rows[k - 1]) * coarse / (fine - coarse))
            rows = new
        size = 1.0 + np.abs(y.astype(float))
        error = np.max(np.abs((rows[-1] - rows[-2]).astype(float)) / size)
    return rows[-1], float(error)


def _midpoint(rate: Rate, y: State, slope: State, step: Any, n: int) -> State:
    """The change of y by Gragg's smoothed midpoint rule with n (even) substeps."""
    h = step / n
    before, change = np.zeros_like(y), h * slope
    for _ in range(n - 1):
        before, change = change, before + 2 * h * rate(y + change)
    last = h * rate(y + change)
    smooth: State = (before + change + last) / 2
    return smooth


def dop853(rate: Rate, start: Array, times: Array) -> Array:
    """The states (n, d) at the rising times (n,) s; `start` (d,) is the state at time 0.

    Raises:
        NoConvergenceError: no step is small enough.
    """
    from scipy.integrate import DOP853  # which few commands need

    y, now, step = start, 0.0, math.inf
    states = []
    for time in times.tolist():
        if time > now:
            first = min(step, time - now) if math.isfinite(step) else None
            solver = DOP853(
                lambda _, y: rate(y), now, y, time, rtol=1e-13, atol=1e-13, first_step=first
            )
            while solver.status == "running":
                solver.step()
                step = solver.h_abs
            if solver.status == "failed":
                raise NoConvergenceError(f"no step is small enough at {solver.t:.6g} s")
            y, now = solver.y, time
        states.append(y)
    return np.array(states)


_NODES = 20


def cumulative_integral(function: Callable[[Array], Array], times: Array, width: float) -> Array:
    """∫₀ᵗ f for each of the rising times (n,): (n,).

    `function` takes times (k,) and gives (k,); on intervals of `width` it must be so smooth that 20
    nodes suffice.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    edges = np.concatenate([[0.0], times])
    gaps = np.diff(edges)
    parts = max(1, math.ceil(float(np.max(gaps)) / width))
    widths = np.repeat(gaps / parts, parts)
    begins = (edges[:-1, None] + gaps[:, None] * np.arange(parts) / parts).ravel()
    at = begins[:, None] + widths[:, None] * (nodes + 1) / 2
    pieces = function(at.ravel()).reshape(at.shape) @ weights * widths / 2
    total: Array = np.cumsum(pieces.reshape(-1, parts).sum(axis=1))
    return total
