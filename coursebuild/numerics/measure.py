"""How far a motion is from its reference, what orders that shows, and what drifts.

Entry points: `errors`, `raised`, `order`, `fitted_orders`; `energy_drift`, `momentum_drift`.

1. Errors of position, attitude and velocity stand apart, each at its largest and at the end: RK4 is
   of fourth order in velocity and of second in attitude.
2. No error is given below ten times what the reference itself may be wrong by.
3. An order is the slope where the error is over a hundred floors and under 0.1: nearer to the floor
   rounding is measured, beyond 0.1 the asymptotic law does not hold yet.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import Run
from coursebuild.numerics.problem import Array, Motion, Reference
from coursebuild.numerics.reports.bench import OrderRow
from mjcourse.spatial import angular_distance

FLOORS = 10.0
"""No error below so many floors of the reference is given."""
_LOWEST, _HIGHEST = 100.0, 0.1
"""Where an order is fitted: over so many floors, and under so much."""

Pair: TypeAlias = tuple[float, float]
"""An error at its largest over the whole duration, and at its end."""


class Sizes(Struct, frozen=True):
    """A size for each of the parts of a motion."""

    position: float
    """m or rad."""
    attitude: float
    """rad."""
    velocity: float
    """m/s or rad/s."""

    @property
    def place(self) -> float:
        """Of positions and attitudes together."""
        return max(self.position, self.attitude)

    @property
    def largest(self) -> float:
        """Of all of them."""
        return max(self.position, self.attitude, self.velocity)


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
    return reference.motion(np.array(times))


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


def order(
    timesteps: Sequence[float], found: Sequence[float], floor: float, *, bent: float = math.inf
) -> float | None:
    """Fit the order to errors found at timesteps (s); `None` where too few of them are usable.

    Args:
        timesteps: in any order.
        found: errors there.
        floor: what the reference may be wrong by, in the unit of the errors.
        bent: how far slopes on the way may differ; beyond, errors follow no one power.
    """
    usable = [
        (math.log(h), math.log(error))
        for h, error in sorted(zip(timesteps, found, strict=True))
        if max(_LOWEST * floor, 1e-300) < error < _HIGHEST
    ]
    if len(usable) < 3:
        return None
    slopes = [(d - b) / (c - a) for (a, b), (c, d) in itertools.pairwise(usable)]
    if max(slopes) - min(slopes) >= bent:
        return None
    x, y = np.array(usable).T
    return float(np.polyfit(x, y, 1)[0])


def fitted_orders(
    integrator: str,
    runs: Sequence[tuple[float, Errors | None]],
    floor: Sizes,
    *,
    extent: Sizes = ONES,
    bent: float = math.inf,
) -> OrderRow:
    """Orders of an integrator, from its timesteps (s) and errors there; lost runs do not count.

    Args:
        integrator: its name.
        runs: timesteps and errors.
        floor: what the reference may be wrong by.
        extent: how much the motion changes: an error as large is no small one.
        bent: see `order`.
    """

    def fitted(part: str) -> float | None:
        most = _HIGHEST * min(1.0, getattr(extent, part))
        pairs = [(h, getattr(one, part)) for h, one in runs if one is not None]
        kept = [(h, pair[0]) for h, pair in pairs if pair is not None and pair[0] < most]
        steps, largest = [h for h, _ in kept], [error for _, error in kept]
        return order(steps, largest, getattr(floor, part), bent=bent)

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
