"""Another high-order integration for references: Gauss's collocation, an implicit Runge–Kutta rule.

Entry point: `collocated(rate, start, times)`.

1. Six stages at Gauss's nodes give order 12; the stages are found by fixed-point iteration, so that
   only the rate is needed.
2. Every interval between two times is cut into equal steps; their number is doubled until two
   results agree, or until they agree no better: rounding is reached then.

It shares nothing with Bulirsch–Stoer: the two together say how well a motion is known.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, II.1.3 and VIII.6.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from coursebuild.numerics.extrapolation import NoConvergenceError, Rate, State
from coursebuild.numerics.problem import Array

STAGES = 6
_ITERATIONS = 40
_DOUBLINGS = 10
_ENOUGH = 1e-14
"""Difference of two results, relative to 1 + |y|, at which doubling ends."""


def collocated(rate: Rate, start: State, times: Array, *, width: float = 0.05) -> State:
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
    slopes = np.tile(rate(y), (STAGES, 1))
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
    nodes, weights = np.polynomial.legendre.leggauss(STAGES)
    at = (nodes + 1) / 2
    matrix = np.empty((STAGES, STAGES))
    for i, end in enumerate(at):
        inner = end * at  # nodes on [0, end]: exact for the basis, whose degree is less than 12
        for j in range(STAGES):
            others = np.delete(at, j)
            basis = np.prod((inner[:, None] - others) / (at[j] - others), axis=1)
            matrix[i, j] = end * float(weights @ basis) / 2
    return matrix, weights / 2
