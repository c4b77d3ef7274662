"""Case 5: a damped spring, whose largest stable timestep is known for every integrator.

Entry point: `problems()`; `limit_of` and `oscillation` serve other linear oscillators too.

Sources: for the semi-implicit method E. Hairer, C. Lubich, G. Wanner, Geometric Numerical
Integration, I.3; for the polynomial of the classical Runge–Kutta method E. Hairer, G. Wanner,
Solving Ordinary Differential Equations II, IV.2.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Limit,
    Motion,
    Problem,
    Reference,
    Scenario,
)
from coursebuild.numerics.problems.common import NO_CONTACT, NO_GRAVITY, motion_without_attitude

RATE = 10.0
"""√(k/m), rad/s."""
START = (1.0, 5.0)
"""m and m/s: from rest the semi-implicit method would seem to be of second order in velocity."""
BOUND = 1e4
"""m: with a double root a stable state may grow a few hundred times before it decays."""
RATIOS = (0.0, 0.1, 1.0, 10.0)
"""ζ, damping relative to the critical one."""


def mjcf(ratio: float, rate: float = RATE) -> str:
    """1 kg on a spring of rate² N/m with a damper of 2 ζ rate N s/m."""
    return f"""\
<mujoco>
  <option {NO_GRAVITY}>{NO_CONTACT}</option>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0" stiffness="{rate**2!r}" damping="{2 * ratio * rate!r}"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


def oscillation(ratio: float, rate: float, x0: float, v0: float, times: Array) -> Motion:
    """x″ + 2ζωx′ + ω²x = 0 from x0 (m) and v0 (m/s), at the times (n,) s."""
    decay = ratio * rate
    if ratio == 1.0:
        fall, b = np.exp(-decay * times), v0 + decay * x0
        place = fall * (x0 + b * times)
        speed = fall * (b - decay * (x0 + b * times))
    elif ratio < 1.0:
        turn = rate * math.sqrt(1 - ratio**2)
        fall, sine, cosine = np.exp(-decay * times), np.sin(turn * times), np.cos(turn * times)
        place = fall * (x0 * cosine + (v0 + decay * x0) / turn * sine)
        speed = fall * (v0 * cosine - (decay * v0 + rate**2 * x0) / turn * sine)
    else:  # the slow root without the difference of large numbers
        fast = -rate * (ratio + math.sqrt(ratio**2 - 1))
        slow = rate**2 / fast
        a, b = (fast * x0 - v0) / (fast - slow), (v0 - slow * x0) / (fast - slow)
        place = a * np.exp(slow * times) + b * np.exp(fast * times)
        speed = slow * a * np.exp(slow * times) + fast * b * np.exp(fast * times)
    return motion_without_attitude(times, place[:, None], speed[:, None])


def integrated(ratio: float, rate: float, x0: float, v0: float, times: Array) -> Motion:
    """The same by Bulirsch–Stoer."""

    def slope(state: State) -> State:
        x, v = state.tolist()
        return np.array([v, -2 * ratio * rate * v - rate**2 * x])

    states = bulirsch_stoer(slope, np.array([x0, v0]), times)
    return motion_without_attitude(times, states[:, :1], states[:, 1:])


def limit_of(
    ratio: float, rate: float, integrator: Integrator, *, explicit: tuple[Integrator, ...]
) -> Limit:
    """The largest stable timestep of a damped oscillator.

    `explicit` are the integrators that take its damping at the beginning of the step.
    """
    root = math.sqrt(ratio**2 + 1)
    if integrator is Integrator.RK4:
        return Limit(rk4_limit(ratio) / rate, "|1 + z + z²/2 + z³/6 + z⁴/24| = 1")
    if integrator is Integrator.DISCRETE:
        return Limit(math.inf, "implicit in positions and velocities")
    if integrator in explicit:
        return Limit(2 * (root - ratio) / rate, "hω = 2(√(ζ²+1) − ζ)")
    return Limit(2 * (root + ratio) / rate, "hω = 2(√(ζ²+1) + ζ)")


def rk4_limit(ratio: float) -> float:
    """The first hω at which the Runge–Kutta method does not damp an oscillator."""
    under = cmath.sqrt(ratio**2 - 1)
    roots = (-ratio + under, -ratio - under)

    def growth(z: float) -> float:
        return max(abs(rk4_factor(root * z)) for root in roots)

    low = high = 0.5 / (1 + ratio)
    while growth(high) <= 1:
        low, high = high, high * 1.01
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if growth(middle) <= 1 else (low, middle)
    return low


def rk4_factor(z: complex) -> complex:
    """R(z): what a step of the classical Runge–Kutta method multiplies by, z = hλ."""
    return 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))


def problems() -> tuple[Problem, ...]:
    """One for each damping ratio."""
    return tuple(_problem(ratio) for ratio in RATIOS)


def references(
    ratio: float, rate: float, source: str, *, floor: float
) -> tuple[Reference, Reference]:
    """The oscillator begun at `START`: its closed form, and an integration.

    `floor` is for a rate of 1 rad/s: velocities are known worse by the rate.
    """
    return (
        Reference(
            "closed", source, lambda times: oscillation(ratio, rate, *START, times), floor * rate
        ),
        Reference(
            "ode",
            "Bulirsch–Stoer",
            lambda times: integrated(ratio, rate, *START, times),
            1e-13 * rate,
        ),
    )


def _problem(ratio: float) -> Problem:
    reference, second = references(ratio, RATE, "the linear oscillator", floor=1e-14)
    return Problem(
        name=f"damped-spring-{ratio:g}",
        title=f"Damped spring, ζ = {ratio:g}",
        case=5,
        mjcf=mjcf(ratio),
        scenario=Scenario(1.0, 0.1, START[:1], START[1:]),
        position_bound=BOUND,
        velocity_bound=BOUND * RATE * (1 + 4 * ratio),
        reference=reference,
        second=second,
        timesteps=tuple(0.1 / n for n in (5, 10, 20, 40, 80, 160, 320, 640)),
        limit=lambda one: limit_of(ratio, RATE, one, explicit=(Integrator.EULER_EXPLICIT,)),
        energy_conserved=ratio == 0,
        search=(1e-2 / RATE, 1e2 / RATE),
    )
