"""Integration for references: of differential equations by two methods, and of functions.

Entry points: `bulirsch_stoer(rate, start, times, tolerance)`, `gauss_collocation(rate, start,
times)`, which share nothing, so that the two together say how well a motion is known;
`cumulative_integral(function, times, width)`; `quaternion_rate`, of an attitude.

*Bulirsch–Stoer*: Gragg's midpoint rule, extrapolated.

1. A step of length H is made by the modified midpoint rule with 2, 4, …, 2k substeps; its error has
   only even powers of the substep, so that Neville's scheme removes them one by one (order 2k).
2. The difference of the last two columns is the error estimate; H follows it.
3. The given times are always ends of steps, so that nothing is interpolated.

The state may be of any numbers that numpy adds and multiplies: float64, or `decimal.Decimal` in an
object array for a reference with more digits.

*Gauss's collocation*, an implicit Runge–Kutta rule.

1. Six stages at Gauss's nodes give order 12; the stages are found by fixed-point iteration, so that
   only the rate is needed.
2. Every interval between two times is cut into equal steps; their number is doubled until two
   results agree, or until they agree no better: rounding is reached then.

Sources: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, II.9;
E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, II.1.3 and VIII.6; P. J. Davis,
P. Rabinowitz, Methods of Numerical Integration, 2.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from functools import cache
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
    carry = np.zeros_like(y) if not exact else None
    found = []
    for time in times.tolist():
        goal: Any = Decimal(time) if exact else time
        while now < goal:
            left = float(goal - now)
            whole = trial >= left * (1 - 1e-12)
            step: Any = goal - now if whole else (Decimal(trial) if exact else trial)
            change, error = _extrapolated(rate, y, step, columns)
            ratio = error / tolerance
            if not ratio <= 1.0:  # also when it is no number
                factor = _SAFETY * ratio ** (-1 / (2 * columns - 1)) if ratio < 1e300 else _SHRINK
                trial = float(step) * max(_SHRINK, min(factor, 0.9))
                if trial < 1e-12 * first:
                    raise NoConvergenceError(f"no step is small enough at {float(now):.6g} s")
                continue
            if carry is None:
                y = y + change
            else:  # Kahan's sum: many small steps must not add up roundings
                change = change - carry
                total = y + change
                carry = (total - y) - change
                y = total
            now = goal if whole else now + step
            grown = float(step) * min(_GROW, _SAFETY * max(ratio, 1e-12) ** (-1 / (2 * columns)))
            trial = max(trial, grown) if whole else grown
        found.append(y.copy())
    return np.array(found)


def _extrapolated(rate: Rate, y: State, step: Any, columns: int) -> tuple[State, float]:
    """The change of y over a step, and its estimated error relative to 1 + |y|."""
    with np.errstate(over="ignore", invalid="ignore"):  # a step too long is made again
        slope = rate(y)
        rows: list[State] = []
        for j in range(1, columns + 1):
            new = [_midpoint(rate, y, slope, step, 2 * j)]
            for k in range(1, j):
                more, fewer = j * j, (j - k) * (j - k)
                new.append(new[-1] + (new[-1] - rows[k - 1]) * fewer / (more - fewer))
            rows = new
        size = 1.0 + np.abs(y.astype(float))
        error = np.max(np.abs((rows[-1] - rows[-2]).astype(float)) / size)
    return rows[-1], float(error)


def _midpoint(rate: Rate, y: State, slope: State, step: Any, n: int) -> State:
    """The change of y by Gragg's smoothed midpoint rule with n (even) substeps."""
    h = step / n
    before, change = np.zeros_like(y), h * slope
    if y.dtype == object:
        before = before + Decimal(0)
    for _ in range(n - 1):
        before, change = change, before + 2 * h * rate(y + change)
    last = h * rate(y + change)
    smooth: State = (before + change + last) / 2
    return smooth


# ------------------------------------------------------------------------------------- collocation

_STAGES = 6
_ITERATIONS = 40
_DOUBLINGS = 10
_ENOUGH = 1e-14
"""Difference of two results, relative to 1 + |y|, at which doubling ends."""


def gauss_collocation(rate: Rate, start: State, times: Array, *, width: float = 0.05) -> State:
    """The states (n, d) at the rising times (n,) s; `start` (d,) is the state at time 0.

    `width`: the first length of steps tried, s.

    Raises:
        NoConvergenceError: the stages are not found, or no number of steps is large enough.
    """
    best: State | None = None
    last = math.inf
    for _ in range(_DOUBLINGS):
        found = _attempt(rate, start, times, width)
        if found is not None and best is not None:
            size = 1.0 + np.abs(found)
            apart = float(np.max(np.abs(found - best) / size))
            if apart <= _ENOUGH or (apart < 1e-6 and apart > last / 4):
                return found
            last = apart
        best = found
        width /= 2
    raise NoConvergenceError(f"collocation does not settle: {last:.1e} between two results")


def _attempt(rate: Rate, start: State, times: Array, width: float) -> State | None:
    y, now = start.copy(), 0.0
    carry = np.zeros_like(y)
    slopes = np.tile(rate(y), (_STAGES, 1))
    states = np.empty((len(times), len(y)))
    for index, time in enumerate(times.tolist()):
        count = math.ceil((time - now) / width - 1e-9)
        for _ in range(count):
            found = _step(rate, y, slopes, (time - now) / count)
            if found is None:
                return None
            slopes, change = found
            change = change - carry  # Kahan's sum, as many small steps add up roundings
            total = y + change
            carry = (total - y) - change
            y = total
        now = time
        states[index] = y
    return states


def _step(rate: Rate, y: State, guess: Array, step: float) -> tuple[Array, State] | None:
    """The slopes of the stages (s, d) and the change of y; `None` where they are not found."""
    matrix, weights = _tableau()
    slopes, last = guess, math.inf
    size = 1.0 + np.abs(y)
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(_ITERATIONS):
            new = np.array([rate(y + step * part) for part in matrix @ slopes])
            change = float(np.max(np.abs(new - slopes) * step / size))
            slopes = new
            if change < 1e-16 or (change < 1e-13 and change >= last / 2):
                return slopes, step * (weights @ slopes)
            if not change < 1e3:  # also when it is no number
                return None
            last = change
    return None


@cache
def _tableau() -> tuple[Array, Array]:
    """Butcher's matrix (s, s) and weights (s,) of Gauss's rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_STAGES)
    at = (nodes + 1) / 2
    matrix = np.empty((_STAGES, _STAGES))
    for i, end in enumerate(at):
        inner = end * at  # nodes on [0, end]: exact for the basis, whose degree is less than 12
        for j in range(_STAGES):
            others = np.delete(at, j)
            basis = np.prod((inner[:, None] - others) / (at[j] - others), axis=1)
            matrix[i, j] = end * float(weights @ basis) / 2
    return matrix, weights / 2


# -------------------------------------------------------------------------------------- quadrature

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


# ----------------------------------------------------------------------------------------- rates


def quaternion_rate(q: Array, omega: Array) -> Array:
    """dq/dt (4,) of one quaternion for an angular velocity (3,) in the body's frame, rad/s."""
    q0, q1, q2, q3 = q.tolist()
    w1, w2, w3 = omega.tolist()
    return np.array(
        [
            (-q1 * w1 - q2 * w2 - q3 * w3) / 2,
            (q0 * w1 + q2 * w3 - q3 * w2) / 2,
            (q0 * w2 + q3 * w1 - q1 * w3) / 2,
            (q0 * w3 + q1 * w2 - q2 * w1) / 2,
        ]
    )
