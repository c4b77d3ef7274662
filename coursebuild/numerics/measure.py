"""Errors of a problem over integrators and timesteps, and what they say.

Entry points: `measure(problem, integrator, timestep)`, `errors`, `order`.

1. A run is judged first: the error of a run that was lost is not given.
2. Errors of position, attitude and velocity stand apart, each at its largest and at the end.
3. No error is given below ten times what the reference itself may be wrong by.
4. An order is the slope where the error is over a hundred floors and under 0.1: nearer to the floor
   rounding is measured, beyond 0.1 the asymptotic law does not hold yet.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from coursebuild.numerics.detector import Judgement
from coursebuild.numerics.engine import Run, compiled, motion_of, refsafe_active, simulate
from coursebuild.numerics.problem import STANDARD, Array, Integrator, Motion, Problem, Reference
from coursebuild.numerics.rotation import angle_between

FLOORS = 10.0
"""No error below so many floors of the reference is given."""
LOWEST, HIGHEST = 100.0, 0.1
"""Where an order is fitted: over so many floors, and under so much."""


class Error(Struct, frozen=True):
    """The difference of two motions in one respect."""

    largest: float
    """Over the whole duration."""
    end: float
    """At its end."""


class Errors(Struct, frozen=True):
    """The difference of two motions; `None` for what they do not have."""

    position: Error | None
    """m or rad: Euclidean norm over coordinates."""
    attitude: Error | None
    """rad: the largest angle of any body."""
    velocity: Error | None
    """m/s or rad/s: Euclidean norm."""


class Measurement(Struct, frozen=True):
    """One run, compared with its reference."""

    problem: str
    integrator: Integrator
    timestep: float
    """s."""
    judgement: Judgement
    errors: Errors | None
    """`None` for a run that was lost, or a problem without reference."""
    floor: float
    """Errors smaller than this were raised to it: the reference is not known better."""
    energy_drift: float | None
    """Largest change of the whole energy with its sign, relative to the kinetic one it began with
    (to its largest, where it began at rest)."""
    momentum_drift: float | None
    """Largest change of the angular momentum, relative to its size at the beginning."""
    penetration: float
    """Deepest contact, m."""
    refsafe: bool
    """Whether MuJoCo softened constraints for this timestep: what was measured is another model."""


def measure(problem: Problem, integrator: Integrator, timestep: float) -> Measurement:
    """Run a problem and compare it with its reference.

    Raises:
        ValueError: the timestep (s) does not divide the interval of the looks.
    """
    run = simulate(problem, integrator, timestep)
    found, floor = None, 0.0
    if problem.reference is not None:
        floor = FLOORS * problem.reference.floor
    if run.judgement.ok and problem.reference is not None:
        model = compiled(problem.mjcf, integrator, timestep)
        motion = motion_of(model, run.times, run.qpos, run.qvel)
        exact = known(problem.reference, tuple(run.times.tolist()))
        found = raised(errors(motion, exact), floor)
    return Measurement(
        problem.name,
        integrator,
        timestep,
        run.judgement,
        found,
        floor,
        energy_drift(run) if problem.energy_conserved else None,
        momentum_drift(run) if problem.momentum_conserved else None,
        run.penetration,
        refsafe_active(compiled(problem.mjcf, integrator, timestep)),
    )


@lru_cache(maxsize=64)
def known(reference: Reference, times: tuple[float, ...]) -> Motion:
    """What a reference says at these times (s); computed once."""
    return reference.motion(np.array(times))


def errors(motion: Motion, exact: Motion) -> Errors:
    """How far a motion is from another at the same times."""
    turned = angle_between(exact.attitude, motion.attitude)
    return Errors(
        _error(np.linalg.norm(motion.position - exact.position, axis=1), motion.position.size),
        _error(np.max(turned, axis=1, initial=0.0), turned.size),
        _error(np.linalg.norm(motion.velocity - exact.velocity, axis=1), motion.velocity.size),
    )


def _error(distances: Array, present: int) -> Error | None:
    if not present:
        return None
    return Error(float(np.max(distances)), float(distances[-1]))


def raised(found: Errors, floor: float) -> Errors:
    """Errors, none below the floor."""

    def up(one: Error | None) -> Error | None:
        return one and Error(max(one.largest, floor), max(one.end, floor))

    return Errors(up(found.position), up(found.attitude), up(found.velocity))


def energy_drift(run: Run, scale: float | None = None) -> float | None:
    """The largest change of potential and kinetic energy together, with its sign.

    Relative to `scale`; without one to the kinetic energy at the beginning, or to its largest where
    it begins at rest.
    """
    whole = run.energy.sum(axis=1)
    if scale is None:
        scale = energy_scale(run)
    if not np.isfinite(whole).all() or scale == 0:
        return None
    changes = (whole - whole[0]) / scale
    return float(changes[np.argmax(np.abs(changes))])


def energy_scale(run: Run) -> float:
    """What changes of energy are large against, J."""
    return float(run.energy[0, 1]) or float(np.max(run.energy[:, 1]))


def momentum_drift(run: Run) -> float | None:
    """The largest change of angular momentum, relative to what it was."""
    scale = float(np.linalg.norm(run.momentum[0]))
    if not np.isfinite(run.momentum).all() or scale == 0:
        return None
    return float(np.max(np.linalg.norm(run.momentum - run.momentum[0], axis=1)) / scale)


class Order(Struct, frozen=True):
    """The slope of error against timestep, on logarithmic axes."""

    value: float
    points: int
    """Timesteps that it was fitted to."""


def order(timesteps: Sequence[float], found: Sequence[float], floor: float) -> Order | None:
    """Fit the order to the errors found at these timesteps (s); `None` where too few are usable.

    `floor` is what the reference may be wrong by, in the unit of the errors.
    """
    usable = [
        (math.log(h), math.log(error))
        for h, error in zip(timesteps, found, strict=True)
        if max(LOWEST * floor, 1e-300) < error < HIGHEST
    ]
    if len(usable) < 3:
        return None
    x, y = np.array(usable).T
    return Order(float(np.polyfit(x, y, 1)[0]), len(usable))


class Orders(Struct, frozen=True):
    """The orders of an integrator on a problem."""

    position: Order | None
    attitude: Order | None
    velocity: Order | None


def orders(problem: Problem, found: Sequence[Measurement]) -> Orders:
    """Orders from measurements of one integrator at several timesteps; lost runs do not count.

    None where the problem is not smooth: a slope would say nothing there.
    """
    if problem.reference is None or not problem.smooth:
        return Orders(None, None, None)
    floor = problem.reference.floor

    def fitted(part: str) -> Order | None:
        pairs = [
            (one.timestep, getattr(one.errors, part).largest)
            for one in found
            if one.errors is not None and getattr(one.errors, part) is not None
        ]
        return order([h for h, _ in pairs], [error for _, error in pairs], floor)

    return Orders(fitted("position"), fitted("attitude"), fitted("velocity"))


def ladder(problem: Problem) -> dict[Integrator, tuple[Measurement, ...]]:
    """The problem's timesteps under every integrator; nothing where it has none."""
    if not problem.timesteps:
        return {}
    return {
        integrator: tuple(measure(problem, integrator, h) for h in problem.timesteps)
        for integrator in STANDARD
    }
