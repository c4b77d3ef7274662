"""How far a motion is from its reference, what orders that shows, and what drifts.

Entry points: `errors`, `largest_errors`, `fitted_orders`; `energy_drift`, `momentum_drift`.

1. Errors of position, attitude and velocity stand apart, each at its largest and at the end: RK4 is
   of fourth order in velocity and of second in attitude.
2. No error is given below ten times what the reference itself may be wrong by.
3. An order is the slope where the error is over a hundred floors and under 0.1: nearer to the floor
   rounding is measured, beyond 0.1 the asymptotic law does not hold yet. It is told only where
   those errors lie on a line, in a logarithmic plot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from coursebuild.numerics.engine import Run
from coursebuild.numerics.problem import Array, Motion, Reference, Sizes
from coursebuild.numerics.reports.bench import FLOORS, Errors, FittedOrder, OrderRow
from mjcourse.spatial import angular_distance

_LOWEST, _HIGHEST = 100.0, 0.1
"""Where an order is fitted: over so many floors, and under so much."""
_FEWEST = 4
"""Errors that an order needs."""
_UNCERTAIN, _BENT = 0.25, 0.25
"""The widest half interval of an order, and the largest bend, with which it is told."""

_ZEROS, _ONES = Sizes(0.0, 0.0, 0.0), Sizes(1.0, 1.0, 1.0)


@lru_cache(maxsize=64)
def reference_motion(reference: Reference, times: tuple[float, ...]) -> Motion:
    """What a reference says at these times (s); computed once."""
    return reference.solution.motion(np.array(times))


def errors(motion: Motion, exact: Motion, floor: Sizes = _ZEROS) -> Errors:
    """How far a motion is from another at the same times; no error is below ten floors."""
    moved, faster = motion.position - exact.position, motion.velocity - exact.velocity
    turned = angular_distance(exact.attitude, motion.attitude)

    def pair(distances: Array, floor: float) -> tuple[float, float]:
        least = FLOORS * floor
        return max(float(np.max(distances)), least), max(float(distances[-1]), least)

    return Errors(
        pair(np.linalg.norm(moved, axis=1), floor.position) if moved.size else None,
        pair(np.max(turned, axis=1), floor.attitude) if turned.size else None,
        pair(np.linalg.norm(faster, axis=1), floor.velocity) if faster.size else None,
    )


def largest_errors(found: Errors) -> Sizes:
    """The largest of each; 0 for what is not there."""
    parts = (found.position, found.attitude, found.velocity)
    return Sizes(*(0.0 if part is None else part[0] for part in parts))


def fitted_order(
    timesteps: Sequence[float], found: Sequence[float], floor: float, extent: float = 1.0
) -> FittedOrder | None:
    """The order that errors found at timesteps (s) show.

    Args:
        timesteps: in any order.
        found: errors there.
        floor: what the reference may be wrong by, in the unit of the errors.
        extent: how much the motion changes: an error as large is no small one.

    Returns:
        `None` where fewer than four errors are between a hundred floors and a tenth of 1 and of the
        extent, or where they do not lie on a line: there is no order to be told then.
    """
    from scipy.special import stdtrit

    usable = [
        (math.log(h), math.log(error))
        for h, error in sorted(zip(timesteps, found, strict=True))
        if max(_LOWEST * floor, 1e-300) < error < _HIGHEST * min(1.0, extent)
    ]
    if len(usable) < _FEWEST:
        return None
    x, y = np.array(usable).T
    slopes = np.diff(y) / np.diff(x)
    slope, shift = np.polyfit(x, y, 1)
    freedom = len(x) - 2
    deviation = math.sqrt(float(np.sum((y - slope * x - shift) ** 2)) / freedom)
    error = deviation / math.sqrt(float(np.sum((x - x.mean()) ** 2)))
    student = float(stdtrit(freedom, 0.975))  # an interval of 95 %
    fit = FittedOrder(float(slope), student * error, float(np.ptp(slopes)))
    return fit if fit.uncertainty <= _UNCERTAIN and fit.bend <= _BENT else None


def fitted_orders(
    integrator: str,
    runs: Sequence[tuple[float, Errors]],
    floor: Sizes,
    extent: Sizes = _ONES,
) -> OrderRow:
    """Orders of an integrator, from its timesteps (s) and errors there; lost runs do not count.

    `floor` and `extent` as for `fitted_order`.
    """

    def fitted(part: str) -> FittedOrder | None:
        known = [(h, pair[0]) for h, one in runs if (pair := getattr(one, part)) is not None]
        steps, found = [h for h, _ in known], [error for _, error in known]
        return fitted_order(steps, found, getattr(floor, part), getattr(extent, part))

    return OrderRow(integrator, fitted("position"), fitted("attitude"), fitted("velocity"))


def energy_drift(run: Run, scale: float | None = None) -> float | None:
    """The largest change of potential and kinetic energy together, with its sign.

    Relative to `scale`, J; without one to `energy_scale`.
    """
    whole = run.energy.sum(axis=1)
    if scale is None:
        scale = energy_scale(run)
    if not np.isfinite(whole).all() or scale == 0:
        return None
    changes = (whole - whole[0]) / scale
    return float(changes[np.argmax(np.abs(changes))])


def energy_scale(run: Run) -> float:
    """The kinetic energy at the beginning, or its largest where it begins at rest, J."""
    return float(run.energy[0, 1]) or float(np.max(run.energy[:, 1]))


def momentum_drift(run: Run) -> float | None:
    """The largest change of angular momentum, relative to what it was."""
    scale = float(np.linalg.norm(run.momentum[0]))
    if not np.isfinite(run.momentum).all() or scale == 0:
        return None
    return float(np.max(np.linalg.norm(run.momentum - run.momentum[0], axis=1)) / scale)
