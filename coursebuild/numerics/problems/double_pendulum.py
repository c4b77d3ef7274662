"""Case 10: a double pendulum, whose errors double until they mean nothing.

Entry point: `problem()`; `DoublePendulum` integrates its equations with 40 digits.

Sines and cosines are states of their own (c′ = −s ω, s′ = c ω), so that the equations are rational
and `decimal` numbers can integrate them. Where the motion is chaotic, one run says little: what is
known of it is said of an ensemble of beginnings that lie around the one of the case.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 1.4 and 8.1; for the
exponent G. Benettin et al., Physical Review A 14 (1976) 2338.
"""

from __future__ import annotations

import decimal
import math
from decimal import Decimal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.engine import advance, compile_model, initial_data, simulate
from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.measure import reference_motion
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
    Sizes,
)
from coursebuild.numerics.problems.common import (
    NO_CONTACT,
    divisions,
    model_text,
    motion_without_attitude,
)

_PARTING_ERROR = 0.1
"""rad: the error at which a motion has nothing in common with the exact one."""
_MEMBERS, _RADIUS = 12, 1e-3
"""The size of the ensemble, and how far it begins from the case, rad."""
_STEP, _SPAN = 1e-3, 50.0
"""s: the timestep of the measurements, and the time over which an exponent is measured."""

_LINK = '<joint type="hinge" axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 0.01 1"/>'
MJCF = model_text(
    f'    <body>{_LINK}<body pos="0 0 -1">{_LINK}</body></body>', 'gravity="0 0 -9.81"', NO_CONTACT
)


class DoublePendulum(Struct, frozen=True):
    """Two like bobs; each one's rod ends at its centre of mass, where the next one hangs."""

    upper: float = 2.0
    """At the beginning, rad."""
    lower: float = 0.5
    """Relative to the upper one, rad."""
    gravity: float = 9.81
    mass: float = 1.0
    length: float = 1.0
    inertia: float = 0.01
    """Of each bob about its centre of mass, kg m²."""

    def motion(self, times: Array) -> Motion:
        """Lagrange's equations with 40 digits, at the rising times (n,) s."""
        with decimal.localcontext(decimal.Context(prec=40)):
            m, g, length = Decimal(self.mass), Decimal(self.gravity), Decimal(self.length)
            m11 = Decimal(self.inertia) + 2 * m * length * length
            m22, m12 = m11 - m * length * length, m * length * length

            def rate(state: State) -> State:
                _, _, c1, s1, c2, s2, w1, w2 = state
                c, s = m12 * (c1 * c2 + s1 * s2), m12 * (s1 * c2 - c1 * s2)
                f1, f2 = -s * w2 * w2 - 2 * m * g * length * s1, s * w1 * w1 - m * g * length * s2
                det = m11 * m22 - c * c
                a1, a2 = (m22 * f1 - c * f2) / det, (m11 * f2 - c * f1) / det
                slopes = [w1, w2, -s1 * w1, c1 * w1, -s2 * w2, c2 * w2, a1, a2]
                return np.array(slopes, dtype=object)

            first, zero = Decimal(self.upper), Decimal(0)
            second = first + Decimal(self.lower)
            start = [first, second, *_cosine_sine(first), *_cosine_sine(second), zero, zero]
            states = bulirsch_stoer(rate, np.array(start, dtype=object), times, 1e-28, columns=12)
        a1, a2, *_, w1, w2 = states.T
        place = np.stack([a1, a2 - a1], axis=1).astype(float)
        return motion_without_attitude(times, place, np.stack([w1, w2 - w1], axis=1).astype(float))


def _cosine_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """The cosine and sine of an angle, by their series."""
    sums, term = [Decimal(0), Decimal(0)], Decimal(1)
    for n in range(80):
        sums[n % 2] += term if n % 4 < 2 else -term
        term = term * angle / (n + 1)
    return sums[0], sums[1]


REFERENCE = Reference("ode", "Lagrange's equations with 40 digits", DoublePendulum())


def _ensemble() -> list[DoublePendulum]:
    """Beginnings on a circle around that of the case."""
    turns = [2 * math.pi * n / _MEMBERS for n in range(_MEMBERS)]
    return [
        DoublePendulum(2.0 + _RADIUS * math.cos(turn), 0.5 + _RADIUS * math.sin(turn))
        for turn in turns
    ]


def horizons(integrator: Integrator) -> list[float]:
    """When the error of the angles first passes 0.1 rad, s, for each member of the ensemble."""
    model, times = compile_model(MJCF, integrator, _STEP), []
    for member in _ensemble():
        scenario = Scenario(20.0, 0.05, (member.upper, member.lower))
        run = simulate(replace(problem(), scenario=scenario), model).states
        truth = reference_motion(replace(REFERENCE, solution=member), tuple(run.times.tolist()))
        error = np.linalg.norm(run.qpos - truth.position, axis=1)
        parted = np.flatnonzero(~(error < _PARTING_ERROR))
        times.append(float(run.times[parted[0]]) if len(parted) else math.inf)
    return times


def exponents(integrator: Integrator) -> list[float]:
    """The largest Lyapunov exponent, 1/s, for each member of the ensemble.

    Two runs of each, brought near to each other again and again.
    """
    model, rates = compile_model(MJCF, integrator, _STEP), []
    for member in _ensemble():
        scenario = Scenario(_SPAN, 0.5, (member.upper, member.lower))
        data, neighbour = initial_data(scenario, model), initial_data(scenario, model)
        distance, total = 1e-8, 0.0
        neighbour.qpos[0] += distance
        for _ in scenario.times:
            for state in (data, neighbour):
                advance(model, state, scenario.steps(_STEP))
            separation = np.concatenate([neighbour.qpos - data.qpos, neighbour.qvel - data.qvel])
            size = float(np.linalg.norm(separation))
            total += math.log(size / distance)
            neighbour.qpos[:] = data.qpos + separation[:2] * distance / size
            neighbour.qvel[:] = data.qvel + separation[2:] * distance / size
        rates.append(total / _SPAN)
    return rates


def problem() -> Problem:
    """Six seconds from (2.0, 0.5) rad at rest: as long as numbers of sixteen digits can tell."""
    return Problem(
        name="double-pendulum",
        title="Double pendulum from (2.0, 0.5) rad",
        case=10,
        mjcf=MJCF,
        scenario=Scenario(6.0, 0.05, (2.0, 0.5)),
        position_bound=1e3,
        velocity_bound=1e2,
        reference=REFERENCE,
        precision=Sizes(1e-7, 0.0, 1e-6),
        timesteps=divisions(0.05, 10, 20, 40, 80, 160, 320, 640),
        checks=(
            ScalarCheck(
                "horizon: when the error at 1 ms passes 0.1 rad",
                "s",
                None,
                horizons,
                f"{_MEMBERS} beginnings {_RADIUS:g} rad around, each against 40 digits",
            ),
            ScalarCheck(
                "Lyapunov exponent, over 50 s at 1 ms",
                "1/s",
                None,
                exponents,
                f"Benettin's method, {_MEMBERS} beginnings {_RADIUS:g} rad around",
                (Integrator.RK4,),
            ),
        ),
        energy_conserved=True,
        note="past the horizon the error of a trajectory means nothing",
    )
