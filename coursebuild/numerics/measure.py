"""How far a motion is from its reference, what orders that shows, and what drifts.

Entry points: `errors`, `raised`, `fitted_orders`; `energy_drift`, `momentum_drift`.

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
from typing import TypeAlias

import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import Run
from coursebuild.numerics.problem import Array, Motion, Reference, Sizes
from coursebuild.numerics.reports.bench import FLOORS, FittedOrder, OrderRow
from mjcourse.spatial import angular_distance

_LOWEST, _HIGHEST = 100.0, 0.1
"""Where an order is fitted: over so many floors, and under so much."""
_FEWEST = 4
"""Errors that an order needs."""
_UNCERTAIN, _BENT = 0.25, 0.25
"""The widest half interval of an order, and the largest bend, with which it is told."""

Pair: TypeAlias = tuple[float, float]
"""An error at its largest over the whole duration, and at its end."""


ONES = Sizes(1.0, 1.0, 1.0)


class Errors(Struct, frozen=True):
    """The difference of two motions; `None` for what they do not have."""

    position: Pair | None
    """m or rad: Euclidean norm over coordinates."""
    attitude: Pair | None
    """rad: the largest angle of any body."""
    velocity: Pair | None
    """m/s or rad/s: Euclidean norm."""

    @property
    def largest(self) -> Sizes:
        """The largest of each; 0 for what is not there."""
        parts = (self.position, self.attitude, self.velocity)
        return Sizes(*(0.0 if part is None else part[0] for part in parts))


@lru_cache(maxsize=64)
def reference_motion(reference: Reference, times: tuple[float, ...]) -> Motion:
    """What a reference says at these times (s); computed once."""
    return reference.solution.motion(np.array(times))


def errors(motion: Motion, exact: Motion) -> Errors:
    """How far a motion is from another at the same times."""
    turned = angular_distance(exact.attitude, motion.attitude)
    return Errors(
        _pair(np.linalg.norm(motion.position - exact.position, axis=1), motion.position.size),
        _pair(np.max(turned, axis=1, initial=0.0), turned.size),
        _pair(np.linalg.norm(motion.velocity - exact.velocity, axis=1), motion.velocity.size),
    )


def _pair(distances: Array, present: int) -> Pair | None:
    return (float(np.max(distances)), float(distances[-1])) if present else None


def raised(found: Errors, floor: Sizes) -> Errors:
    """Errors, none below ten floors."""

    def up(pair: Pair | None, floor: float) -> Pair | None:
        return pair and (max(pair[0], FLOORS * floor), max(pair[1], FLOORS * floor))

    return Errors(
        up(found.position, floor.position),
        up(found.attitude, floor.attitude),
        up(found.velocity, floor.velocity),
    )


# ------------------------------------------------------------------------------------------ orders


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
    fit = FittedOrder(float(slope), _student(freedom) * error, float(np.ptp(slopes)))
    return fit if fit.uncertainty <= _UNCERTAIN and fit.bend <= _BENT else None


def _student(freedom: int) -> float:
    """Student's factor of an interval of 95 %."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.975))


def fitted_orders(
    integrator: str,
    runs: Sequence[tuple[float, Errors | None]],
    floor: Sizes,
    extent: Sizes = ONES,
) -> OrderRow:
    """Orders of an integrator, from its timesteps (s) and errors there; lost runs do not count.

    `floor` and `extent` as for `fitted_order`.
    """

    def fitted(part: str) -> FittedOrder | None:
        pairs = [(h, getattr(one, part)) for h, one in runs if one is not None]
        kept = [(h, pair[0]) for h, pair in pairs if pair is not None]
        steps, largest = [h for h, _ in kept], [error for _, error in kept]
        return fitted_order(steps, largest, getattr(floor, part), getattr(extent, part))

    return OrderRow(integrator, fitted("position"), fitted("attitude"), fitted("velocity"))


# ------------------------------------------------------------------------------------------ drifts


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
