"""The errors of a motion against its reference, the orders that they show, and drifts.

Entry points: `errors`, `largest_errors`, `fit_orders`; `energy_drift`, `momentum_drift`.

1. Errors of position, attitude and velocity stand apart, each at its largest and at the end: RK4 is
   of fourth order in velocity and of second in attitude.
2. No error is given below ten times the floor, by which the reference itself may be off.
3. An order is the slope where the error is over a hundred floors and under 0.1: nearer to the floor
   rounding is measured, beyond 0.1 the asymptotic law does not hold yet. It is given only where
   those errors lie on a line, in a logarithmic plot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from coursebuild.numerics.problem import Array, Motion, Reference, Sizes
from coursebuild.numerics.reports.bench import FLOORS, Errors, FittedOrder, OrderRow
from mjcourse.spatial import angular_distance

_LOWEST, _HIGHEST = 100.0, 0.1
"""An order is fitted to errors over so many floors, and under so much."""
_FEWEST = 4
"""Errors that an order needs."""
_UNCERTAIN, _BENT = 0.25, 0.25
"""The widest half interval of an order, and the largest bend, with which it is given."""

_ZERO_SIZES, _UNIT_SIZES = Sizes(0.0, 0.0, 0.0), Sizes(1.0, 1.0, 1.0)


@lru_cache(maxsize=64)
def reference_motion(reference: Reference, times: tuple[float, ...]) -> Motion:
    """The motion of a reference at these times (s); computed once."""
    return reference.solution.motion(np.array(times))


def errors(motion: Motion, exact: Motion, floor: Sizes = _ZERO_SIZES) -> Errors:
    """The errors of a motion against an exact one at the same times; none is below ten floors."""
    displacements, speed_differences = (
        motion.position - exact.position,
        motion.velocity - exact.velocity,
    )
    angles = angular_distance(exact.attitude, motion.attitude)

    def pair(distances: Array, floor: float) -> tuple[float, float]:
        least = FLOORS * floor
        return max(float(np.max(distances)), least), max(float(distances[-1]), least)

    return Errors(
        pair(np.linalg.norm(displacements, axis=1), floor.position) if displacements.size else None,
        pair(np.max(angles, axis=1), floor.attitude) if angles.size else None,
        pair(np.linalg.norm(speed_differences, axis=1), floor.velocity)
        if speed_differences.size
        else None,
    )


def largest_errors(motion_errors: Errors) -> Sizes:
    """The largest error of each part; 0 for a part that is missing."""
    parts = (motion_errors.position, motion_errors.attitude, motion_errors.velocity)
    return Sizes(*(0.0 if part is None else part[0] for part in parts))


def fit_order(
    timesteps: Sequence[float], errors: Sequence[float], floor: float, extent: float = 1.0
) -> FittedOrder | None:
    """The order that errors at timesteps (s) show.

    Args:
        timesteps: in any order.
        errors: one for each timestep.
        floor: how far the reference may be off, in the unit of the errors.
        extent: how much the motion changes, to know which errors are small.

    Returns:
        `None` where fewer than four errors are between a hundred floors and a tenth of 1 and of the
        extent, or where they do not lie on a line: there is no order to be told then.
    """
    from scipy.special import stdtrit

    usable = [
        (math.log(h), math.log(error))
        for h, error in sorted(zip(timesteps, errors, strict=True))
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


def fit_orders(
    integrator: str,
    runs: Sequence[tuple[float, Errors]],
    floor: Sizes,
    extent: Sizes = _UNIT_SIZES,
) -> OrderRow:
    """Orders of an integrator, from its timesteps (s) and errors there; lost runs do not count.

    `floor` and `extent` as for `fit_order`.
    """

    def fit(part: str) -> FittedOrder | None:
        pairs = [
            (h, pair[0])
            for h, run_errors in runs
            if (pair := getattr(run_errors, part)) is not None
        ]
        steps, errors = [h for h, _ in pairs], [error for _, error in pairs]
        return fit_order(steps, errors, getattr(floor, part), getattr(extent, part))

    return OrderRow(integrator, fit("position"), fit("attitude"), fit("velocity"))


def energy_drift(energy: Array, scale: float | None = None) -> float | None:
    """The largest change of potential and kinetic energy together, with its sign.

    `energy`: both (n, 2), J. Relative to `scale`, J; without one to `energy_scale`.
    """
    whole = energy.sum(axis=1)
    if scale is None:
        scale = energy_scale(energy)
    if not np.isfinite(whole).all() or scale == 0:
        return None
    changes = (whole - whole[0]) / scale
    return float(changes[np.argmax(np.abs(changes))])


def energy_scale(energy: Array) -> float:
    """The kinetic energy at the beginning, J; where that is 0, its largest."""
    return float(energy[0, 1]) or float(np.max(energy[:, 1]))


def momentum_drift(momentum: Array) -> float | None:
    """The largest change of angular momentum (n, 3), relative to its initial size."""
    scale = float(np.linalg.norm(momentum[0]))
    if not np.isfinite(momentum).all() or scale == 0:
        return None
    return float(np.max(np.linalg.norm(momentum - momentum[0], axis=1)) / scale)
