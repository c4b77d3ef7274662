"""Case 3: a symmetric top, a thin rod and a coin that turn freely, and a heavy top.

Entry point: `problems()`; `FreeTop` is the closed form, `transverse_growth` what a step multiplies
the transverse velocity by.

Sources: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 5.6. A step of the explicit
update ω + h ω̇ multiplies the transverse part by 1 + iz, z = hΩ; one of the linearly implicit update
by 1/(1 − iz); the Runge–Kutta method by its stability polynomial.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import advance, compiled, initial_data
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
from coursebuild.numerics.problems.common import NO_CONTACT, NO_GRAVITY, free_body_motion
from coursebuild.numerics.problems.damped_spring import rk4_factor
from mjcourse.spatial import axis_angle_to_quat, quat_mul

_STEPS = 200
_AXIAL = np.array([0.0, 0.0, 1.0])


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

    def motion(self, times: Array) -> Motion:
        """ω turns at Ω; the body at −Ω about its axis and at |L|/Iₜ about the angular momentum."""
        turn = self.rate * times
        x, y, z = self.omega
        cosine, sine = np.cos(turn), np.sin(turn)
        omega = np.stack([x * cosine - y * sine, x * sine + y * cosine, np.full_like(turn, z)], 1)
        momentum = self.inertia * np.array(self.omega)
        size = float(np.linalg.norm(momentum))
        about = axis_angle_to_quat(momentum / size, size / self.transverse * times)
        attitude = quat_mul(about, axis_angle_to_quat(_AXIAL, -turn))
        still = np.zeros((len(times), 3))
        return Motion(times, still, attitude[:, None], np.concatenate([still, omega], axis=1))


TOPS = {
    "free-top": FreeTop(0.02, 0.03, (1.0, 0.0, 40.0)),
    "thin-rod": FreeTop(0.01, 1e-6, (1.0, 0.0, 20.0)),
    "coin": FreeTop(1.0e-6, 1.999e-6, (1.0, 0.0, 20.0)),
}
_TITLES = {
    "free-top": "Symmetric top, free",
    "thin-rod": "Thin rod, free",
    "coin": "Coin, free",
}


def mjcf(top: FreeTop) -> str:
    """1 kg with these moments."""
    t, a = top.transverse, top.axial
    return f"""\
<mujoco>
  <option {NO_GRAVITY}>{NO_CONTACT}</option>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="{t!r} {t!r} {a!r}"/>
    </body>
  </worldbody>
</mujoco>
"""


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
    model = compiled(mjcf(top), integrator, z / abs(top.rate))
    data = initial_data(_problem(name, top), model)
    first = math.hypot(data.qvel[3], data.qvel[4])
    advance(model, data, _STEPS)
    return float((math.hypot(data.qvel[3], data.qvel[4]) / first) ** (1 / _STEPS))


def problems() -> tuple[Problem, ...]:
    """The free ones; the heavy top has a module of its own."""
    return tuple(_problem(name, top) for name, top in TOPS.items())


def _figure(name: str, z: float) -> ScalarCheck:
    return ScalarCheck(
        f"growth of the transverse velocity in a step, hΩ = {z:g}",
        "",
        lambda integrator: transverse_growth(integrator, z),
        lambda integrator: measured_growth(name, integrator, z),
        "√(1+z²), 1/√(1+z²), |R(iz)|",
    )


def _problem(name: str, top: FreeTop) -> Problem:
    return Problem(
        name=name,
        title=_TITLES[name],
        case=3,
        mjcf=mjcf(top),
        scenario=Scenario(1.0, 0.05, (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, *top.omega)),
        position_bound=1.5,
        velocity_bound=10 * abs(top.omega[2]),
        reference=Reference("closed", "Goldstein, 5.6", top.motion, floor=1e-13),
        second=Reference(
            "ode",
            "Euler's equations and quaternions, Bulirsch–Stoer",
            lambda times: free_body_motion(top.inertia, np.array(top.omega), times),
            floor=1e-12,
        ),
        timesteps=tuple(0.05 / n for n in (40, 80, 160, 320, 640, 1280)),
        checks=tuple(_figure(name, z) for z in (0.03, 0.1, 0.3)),
        limit=lambda integrator: _limit(top, integrator),
        search=(1e-2 / abs(top.rate), 1e1 / abs(top.rate)),
        energy_conserved=True,
        momentum_conserved=True,
        note="Euler is stable at no timestep: what is measured is where 10 000 steps show it",
    )
