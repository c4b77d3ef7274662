"""Case 3: a symmetric top, a thin rod and a coin that turn freely, and Lagrange's heavy top.

Entry point: `problems()`; `FreeTop` is a closed form, `transverse_growth` what a step multiplies
the transverse velocity by, `heavy_motion` the closed form of the heavy top.

1. A step of the explicit update ω + h ω̇ multiplies the transverse part by 1 + iz, z = hΩ; one of
   the linearly implicit update by 1/(1 − iz); the Runge–Kutta method by its stability polynomial.
2. The heavy top, let go at a tilt with spin only: u = cos θ obeys
   u′² = (u₀ − u)(β(1 − u²) − a²(u₀ − u)), so that u oscillates between u₀ and the lower root as
   Jacobi's cd²; precession and spin are quadratures.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 5.6 and 5.7.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from coursebuild.numerics.elliptic import jacobi
from coursebuild.numerics.integrate import cumulative_integral
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Limit,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems.common import (
    NO_CONTACT,
    NO_GRAVITY,
    divisions,
    engine_reference,
    model_text,
    simulated,
    turning_at_rest,
)
from coursebuild.numerics.problems.oscillators import rk4_factor
from mjcourse.spatial import axis_angle_to_quat, quat_mul

NEVER_STABLE = "Euler is stable at no timestep: what is measured is where that shows"
_STEPS = 200
_Y, _Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def problems() -> tuple[Problem, ...]:
    """The free ones, and the heavy top."""
    return (*(_free(name) for name in TOPS), _heavy())


# ------------------------------------------------------------------------------------------- free


class FreeTop(Struct, frozen=True):
    """A body with two equal moments, about its resting centre of mass."""

    transverse: float
    """Moment about x and y, kg m²."""
    axial: float
    """Moment about z, kg m²."""
    omega: tuple[float, float, float]
    """At the beginning, in the body's frame, rad/s."""

    @property
    def inertia(self) -> Array:
        """(3,) kg m²."""
        return np.array([self.transverse, self.transverse, self.axial])

    @property
    def rate(self) -> float:
        """Ω, at which ω turns about the axis in the body's frame, rad/s."""
        return (self.axial - self.transverse) / self.transverse * self.omega[2]

    def mjcf(self) -> str:
        """1 kg with these moments."""
        t, a = self.transverse, self.axial
        inertial = f'<inertial pos="0 0 0" mass="1" diaginertia="{t!r} {t!r} {a!r}"/>'
        return model_text(f"    <body><freejoint/>{inertial}</body>", NO_GRAVITY, NO_CONTACT)

    def scenario(self) -> Scenario:
        """A second, with these velocities."""
        return Scenario(1.0, 0.05, (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, *self.omega))

    def motion(self, times: Array) -> Motion:
        """ω turns at Ω; the body at −Ω about its axis and at |L|/Iₜ about the angular momentum."""
        turn = self.rate * times
        x, y, z = self.omega
        cosine, sine = np.cos(turn), np.sin(turn)
        omega = np.stack([x * cosine - y * sine, x * sine + y * cosine, np.full_like(turn, z)], 1)
        momentum = self.inertia * np.array(self.omega)
        size = float(np.linalg.norm(momentum))
        about = axis_angle_to_quat(momentum, size / self.transverse * times)
        return turning_at_rest(times, quat_mul(about, axis_angle_to_quat(_Z, -turn)), omega)

    @property
    def reference(self) -> Reference:
        """The closed form."""
        return Reference("closed", "Goldstein, 5.6", self.motion, floor=1e-13)


TOPS = {
    "free-top": FreeTop(0.02, 0.03, (1.0, 0.0, 40.0)),
    "thin-rod": FreeTop(0.01, 1e-6, (1.0, 0.0, 20.0)),
    "coin": FreeTop(1.0e-6, 1.999e-6, (1.0, 0.0, 20.0)),
}
_TITLES = {"free-top": "Symmetric top, free", "thin-rod": "Thin rod, free", "coin": "Coin, free"}


def transverse_growth(integrator: Integrator, z: float) -> float:
    """By what a step multiplies the transverse angular velocity, z = hΩ."""
    match integrator:
        case Integrator.EULER | Integrator.EULER_EXPLICIT:
            return math.hypot(1.0, z)
        case Integrator.RK4:
            return abs(rk4_factor(1j * z))
        case Integrator.IMPLICIT | Integrator.IMPLICITFAST | Integrator.DISCRETE:
            return 1.0 / math.hypot(1.0, z)


def _limit(top: FreeTop, integrator: Integrator) -> Limit:
    match integrator:
        case Integrator.EULER | Integrator.EULER_EXPLICIT:
            return Limit(0.0, "√(1+z²) > 1")
        case Integrator.RK4:
            return Limit(2 * math.sqrt(2) / abs(top.rate), "|R(iz)| = 1")
        case Integrator.IMPLICIT | Integrator.IMPLICITFAST | Integrator.DISCRETE:
            return Limit(math.inf, "1/√(1+z²) < 1")


def measured_growth(name: str, integrator: Integrator, z: float) -> float:
    """The mean growth over some steps, by which the first and the last velocity differ."""
    top = TOPS[name]
    data = simulated(top.mjcf(), top.scenario(), integrator, z / abs(top.rate), _STEPS)
    first = math.hypot(*top.omega[:2])
    return float((math.hypot(data.qvel[3], data.qvel[4]) / first) ** (1 / _STEPS))


def _growth(name: str, z: float) -> ScalarCheck:
    return ScalarCheck(
        f"growth of the transverse velocity in a step, hΩ = {z:g}",
        "",
        lambda integrator: transverse_growth(integrator, z),
        lambda integrator: measured_growth(name, integrator, z),
        "√(1+z²), 1/√(1+z²), |R(iz)|",
    )


def _free(name: str) -> Problem:
    top = TOPS[name]
    return Problem(
        name=name,
        title=_TITLES[name],
        case=3,
        mjcf=top.mjcf(),
        scenario=top.scenario(),
        position_bound=1.5,
        velocity_bound=10 * abs(top.omega[2]),
        reference=top.reference,
        second=engine_reference(top.mjcf(), top.scenario()),
        timesteps=divisions(0.05, 40, 80, 160, 320, 640, 1280),
        checks=tuple(_growth(name, z) for z in (0.03, 0.1, 0.3)),
        limit=lambda integrator: _limit(top, integrator),
        search=(1e-2 / abs(top.rate), 1e1 / abs(top.rate)),
        span=100.0,
        energy_conserved=True,
        momentum_conserved=True,
        note=NEVER_STABLE,
    )


# ------------------------------------------------------------------------------------------ heavy

GRAVITY, MASS, HEIGHT = 9.81, 0.5, 0.06
"""m/s², kg, and m from the pivot to the centre of mass."""
AXIAL, CENTRAL = 4e-4, 3e-4
"""Moments about the axis and across it through the centre of mass, kg m²."""
TRANSVERSE = CENTRAL + MASS * HEIGHT**2
SPIN, TILT = 250.0, 0.5
"""rad/s and rad."""
_A = AXIAL * SPIN / TRANSVERSE
_BETA = 2 * MASS * GRAVITY * HEIGHT / TRANSVERSE
_U0 = math.cos(TILT)
_ROOT = math.sqrt(_A**4 - 4 * _BETA * (_A**2 * _U0 - _BETA))
_LOW = 2 * (_A**2 * _U0 - _BETA) / (_A**2 + _ROOT)
_HIGH = (_A**2 + _ROOT) / (2 * _BETA)
_RATE = math.sqrt(_BETA * (_HIGH - _LOW)) / 2
_DEPTH = _BETA * (1 - _LOW**2) / _A**2
"""u₀ − the lower root, without the difference of near numbers."""


def _fall(times: Array) -> tuple[Array, Array]:
    """u₀ − u (n,) and its rate (n,) 1/s."""
    m1 = (_HIGH - _U0) / (_HIGH - _LOW)
    sn, cn, dn = jacobi(_RATE * times, m1)
    # 1 − cd² = (1 − m) sd²
    fallen = _DEPTH * m1 * (sn / dn) ** 2
    return fallen, _DEPTH * m1 * 2 * sn * cn / dn**3 * _RATE


def _precession_rate(times: Array) -> Array:
    fallen, _ = _fall(times)
    u = _U0 - fallen
    rate: Array = _A * fallen / (1 - u * u)
    return rate


def heavy_motion(times: Array) -> Motion:
    """Attitude and angular velocity in the body's frame at the times (n,) s."""
    fallen, sinking = _fall(times)
    u = _U0 - fallen
    sine = np.sqrt(1 - u * u)
    tilt = np.arctan2(sine, u)
    around = _precession_rate(times)
    precession = cumulative_integral(_precession_rate, times, 0.3 / _RATE)
    own = SPIN * times - cumulative_integral(
        lambda at: _precession_rate(at) * (_U0 - _fall(at)[0]), times, 0.3 / _RATE
    )
    tilted = quat_mul(axis_angle_to_quat(_Z, precession), axis_angle_to_quat(_Y, tilt))
    attitude = quat_mul(tilted, axis_angle_to_quat(_Z, own))
    nod = sinking / sine
    omega = np.stack(
        [
            -around * sine * np.cos(own) + nod * np.sin(own),
            around * sine * np.sin(own) + nod * np.cos(own),
            np.full_like(times, SPIN),
        ],
        axis=1,
    )
    return Motion(times, np.empty((len(times), 0)), attitude[:, None], omega)


def _heavy() -> Problem:
    """Half a second of the top, let go with spin only."""
    moments = f'diaginertia="{CENTRAL} {CENTRAL} {AXIAL}"'
    inertial = f'<inertial pos="0 0 {HEIGHT}" mass="{MASS}" {moments}/>'
    world = f'    <body><joint type="ball"/>{inertial}</body>'
    mjcf = model_text(world, f'gravity="0 0 -{GRAVITY}"', NO_CONTACT)
    turned = (math.cos(TILT / 2), 0, math.sin(TILT / 2), 0)
    scenario = Scenario(0.5, 0.02, turned, (0, 0, SPIN))
    return Problem(
        name="heavy-top",
        title="Heavy top on a ball joint, 250 rad/s",
        case=3,
        mjcf=mjcf,
        scenario=scenario,
        position_bound=1.5,
        velocity_bound=4 * SPIN,
        reference=Reference(
            "closed", "Lagrange's top, Goldstein, 5.7, with quadratures", heavy_motion, floor=1e-12
        ),
        second=engine_reference(mjcf, scenario),
        timesteps=divisions(0.02, 40, 80, 160, 320, 640, 1280),
        search=(1e-5, 1.0),
        span=2.0,
        energy_conserved=True,
        note=NEVER_STABLE,
    )
