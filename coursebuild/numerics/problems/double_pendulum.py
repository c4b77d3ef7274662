"""Case 10: a double pendulum, whose errors double until they mean nothing.

Entry point: `problem()`; `exact(times)` is the reference, with 40 digits.

Sines and cosines are states of their own (c′ = −s ω, s′ = c ω), so that the equations are rational
and `decimal` numbers can integrate them. The second reference has Hamilton's equations and other
digits and steps.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 1.4 and 8.1; for the
exponent G. Benettin et al., Physical Review A 14 (1976) 2338.
"""

from __future__ import annotations

import decimal
import math
from decimal import Decimal
from typing import Any

import numpy as np

from coursebuild.numerics.engine import advance, compiled, initial_data, simulate
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
)
from coursebuild.numerics.problems.common import NO_CONTACT, model_text, motion_without_attitude

START = (2.0, 0.5)
"""Angle of the upper joint and of the lower one relative to it, rad."""
DURATION = 14.0
_GRAVITY, _INERTIA = "9.81", "0.01"
"""m/s², and kg m² of each bob about its centre; masses are 1 kg, lengths 1 m."""
_HORIZON_ERROR = 0.1

_LINK = (
    '<joint type="hinge" axis="0 1 0"/>'
    f'<inertial pos="0 0 -1" mass="1" diaginertia="{_INERTIA} {_INERTIA} {_INERTIA}"/>'
)
MJCF = model_text(
    f'    <body>{_LINK}<body pos="0 0 -1">{_LINK}</body></body>',
    f'gravity="0 0 -{_GRAVITY}"',
    NO_CONTACT,
)


def exact(times: Array) -> Motion:
    """Lagrange's equations with 40 digits, at the rising times (n,) s."""
    with decimal.localcontext(decimal.Context(prec=40)):
        g, inertia = _parameters()

        def rate(state: State) -> State:
            _, _, c1, s1, c2, s2, w1, w2 = state
            c, s = c1 * c2 + s1 * s2, s1 * c2 - c1 * s2
            m11, m22 = 2 + inertia, 1 + inertia
            f1, f2 = -s * w2 * w2 - 2 * g * s1, s * w1 * w1 - g * s2
            det = m11 * m22 - c * c
            a1, a2 = (m22 * f1 - c * f2) / det, (m11 * f2 - c * f1) / det
            return np.array([w1, w2, -s1 * w1, c1 * w1, -s2 * w2, c2 * w2, a1, a2], dtype=object)

        zero = Decimal(0)
        states = bulirsch_stoer(rate, _begin(zero, zero), times, 1e-28, columns=12)
        return _motion(times, states[:, 0], states[:, 1], states[:, 6], states[:, 7])


REFERENCE = Reference(
    "ode", "Lagrange's equations, Bulirsch–Stoer with 40 digits", exact, floor=1e-13
)


def hamiltonian(times: Array) -> Motion:
    """Hamilton's equations with 45 digits, at the rising times (n,) s."""
    with decimal.localcontext(decimal.Context(prec=45)):
        g, inertia = _parameters()
        m11, m22 = 2 + inertia, 1 + inertia

        def velocities(c: Any, p1: Any, p2: Any) -> tuple[Any, Any]:
            det = m11 * m22 - c * c
            return (m22 * p1 - c * p2) / det, (m11 * p2 - c * p1) / det

        def rate(state: State) -> State:
            _, _, c1, s1, c2, s2, p1, p2 = state
            c, s = c1 * c2 + s1 * s2, s1 * c2 - c1 * s2
            w1, w2 = velocities(c, p1, p2)
            pull = s * w1 * w2
            f1, f2 = -pull - 2 * g * s1, pull - g * s2
            return np.array([w1, w2, -s1 * w1, c1 * w1, -s2 * w2, c2 * w2, f1, f2], dtype=object)

        zero = Decimal(0)
        states = bulirsch_stoer(rate, _begin(zero, zero), times, 1e-30, columns=14)
        c = states[:, 2] * states[:, 4] + states[:, 3] * states[:, 5]
        w1, w2 = velocities(c, states[:, 6], states[:, 7])
        return _motion(times, states[:, 0], states[:, 1], w1, w2)


def _parameters() -> tuple[Decimal, Decimal]:
    """Gravity and inertia, as the doubles that MuJoCo reads."""
    return Decimal(float(_GRAVITY)), Decimal(float(_INERTIA))


def _begin(third: Decimal, fourth: Decimal) -> State:
    first = Decimal(START[0])
    second = first + Decimal(START[1])
    trigonometry = (*_cosine_sine(first), *_cosine_sine(second))
    return np.array([first, second, *trigonometry, third, fourth], dtype=object)


def _cosine_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """By their series."""
    sums, term = [Decimal(0), Decimal(0)], Decimal(1)
    for n in range(80):
        sums[n % 2] += term if n % 4 < 2 else -term
        term = term * angle / (n + 1)
    return sums[0], sums[1]


def _motion(times: Array, first: State, second: State, w1: State, w2: State) -> Motion:
    """Angles from the vertical → angles of the joints."""
    place = np.stack([first, second - first], axis=1).astype(float)
    speed = np.stack([w1, w2 - w1], axis=1).astype(float)
    return motion_without_attitude(times, place, speed)


def horizon(integrator: Integrator, timestep: float = 1e-3) -> float:
    """When the error of the angles first passes 0.1 rad, s."""
    one = problem()
    found = simulate(one, compiled(MJCF, integrator, timestep)).states
    truth = reference_motion(REFERENCE, tuple(found.times.tolist()))
    error = np.linalg.norm(found.qpos - truth.position, axis=1)
    beyond = np.flatnonzero(~(error < _HORIZON_ERROR))
    return float(found.times[beyond[0]]) if len(beyond) else math.inf


def lyapunov(integrator: Integrator, timestep: float = 1e-3, duration: float = 200.0) -> float:
    """The largest Lyapunov exponent, 1/s: two runs, brought near to each other again and again."""
    one = problem()
    model = compiled(MJCF, integrator, timestep)
    data, near = initial_data(one.scenario, model), initial_data(one.scenario, model)
    distance, every, total = 1e-8, round(0.5 / timestep), 0.0
    near.qpos[0] += distance
    parts = round(duration / 0.5)
    for _ in range(parts):
        advance(model, data, every)
        advance(model, near, every)
        apart = np.concatenate([near.qpos - data.qpos, near.qvel - data.qvel])
        size = float(np.linalg.norm(apart))
        total += math.log(size / distance)
        near.qpos[:] = data.qpos + apart[:2] * distance / size
        near.qvel[:] = data.qvel + apart[2:] * distance / size
    return total / duration


def problem() -> Problem:
    """Fourteen seconds from (2.0, 0.5) rad at rest."""
    return Problem(
        name="double-pendulum",
        title="Double pendulum from (2.0, 0.5) rad",
        case=10,
        mjcf=MJCF,
        scenario=Scenario(DURATION, 0.05, START),
        position_bound=1e3,
        velocity_bound=1e2,
        reference=REFERENCE,
        second=Reference(
            "ode", "Hamilton's equations, Bulirsch–Stoer with 45 digits", hamiltonian, floor=1e-13
        ),
        checks=(
            ScalarCheck(
                "horizon: when the error at 1 ms passes 0.1 rad",
                "s",
                None,
                horizon,
                "against the reference with 40 digits",
            ),
            ScalarCheck(
                "Lyapunov exponent, over 200 s at 1 ms",
                "1/s",
                None,
                lyapunov,
                "Benettin's method",
                (Integrator.RK4,),
            ),
        ),
        energy_conserved=True,
        note="past the horizon the error of a trajectory means nothing",
    )
