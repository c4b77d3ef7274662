"""Case 3: a symmetric top, a thin rod and a coin that turn freely, and Lagrange's heavy top.

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

from mjbench.integrate import cumulative_integral
from mjbench.problem import (
    NO_CONTACT,
    NO_GRAVITY,
    Array,
    Integrator,
    Limit,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
    divisions,
    model_text,
    turning_at_rest,
)
from mjbench.problems.oscillators import rk4_factor
from mjbench.rotations import axis_angle_to_quat, quat_mul
from mjbench.simulation import run_steps

NEVER_STABLE = "Euler is stable at no timestep: what is measured is where that shows"
_STEPS = 200
_Y, _Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def problems() -> tuple[Problem, ...]:
    """The free ones, and half a second of the heavy top."""
    inertial = '<inertial pos="0 0 0.06" mass="0.5" diaginertia="3e-4 3e-4 4e-4"/>'
    world = f'    <body><joint type="ball"/>{inertial}</body>'
    quaternion = (0.9689124217106447, 0.0, 0.24740395925452294, 0.0)
    heavy_top = Problem(
        name="heavy-top",
        title="Heavy top on a ball joint, 250 rad/s",
        case=3,
        mjcf=model_text(world, 'gravity="0 0 -9.81"', NO_CONTACT),
        scenario=Scenario(0.5, 0.02, quaternion, (0.0, 0.0, 250.0)),
        position_bound=1.5,
        velocity_bound=1000.0,
        reference=Reference("closed", "Lagrange's top, Goldstein, 5.7, with quadratures", _TOP),
        timesteps=divisions(0.02, 40, 80, 160, 320, 640, 1280),
        search=(1e-5, 1.0),
        span=2.0,
        energy_conserved=True,
        note=NEVER_STABLE,
    )
    return (*map(_free_problem, TOPS), heavy_top)


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
        precession = axis_angle_to_quat(momentum, size / self.transverse * times)
        return turning_at_rest(times, quat_mul(precession, axis_angle_to_quat(_Z, -turn)), omega)


def free_body(moments: str) -> str:
    """1 kg with these moments, kg m²."""
    inertial = f'<inertial pos="0 0 0" mass="1" diaginertia="{moments}"/>'
    return model_text(f"    <body><freejoint/>{inertial}</body>", NO_GRAVITY, NO_CONTACT)


def spinning(x: float, y: float, z: float) -> Scenario:
    """A second of a free body with this angular velocity, rad/s."""
    return Scenario(1.0, 0.05, qvel=(0.0, 0.0, 0.0, x, y, z))


def top_reference(top: FreeTop) -> Reference:
    """The closed form as a reference."""
    return Reference("closed", "Goldstein, 5.6", top)


TOPS = {
    "free-top": FreeTop(0.02, 0.03, (1.0, 0.0, 40.0)),
    "thin-rod": FreeTop(0.01, 1e-6, (1.0, 0.0, 20.0)),
    "coin": FreeTop(1.0e-6, 1.999e-6, (1.0, 0.0, 20.0)),
}
_FREE_BODIES = {
    "free-top": ("Symmetric top, free", free_body("0.02 0.02 0.03"), spinning(1.0, 0.0, 40.0)),
    "thin-rod": ("Thin rod, free", free_body("0.01 0.01 1e-6"), spinning(1.0, 0.0, 20.0)),
    "coin": ("Coin, free", free_body("1e-6 1e-6 1.999e-6"), spinning(1.0, 0.0, 20.0)),
}
"""Titles, models and scenarios."""


def transverse_growth(integrator: Integrator, z: float) -> float:
    """The factor by which a step multiplies the transverse angular velocity, z = hΩ."""
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
    """The mean growth in a step, from the first and the last velocity of some steps."""
    top = TOPS[name]
    _, mjcf, scenario = _FREE_BODIES[name]
    data = run_steps(mjcf, scenario, integrator, z / abs(top.rate), _STEPS)
    first = math.hypot(*top.omega[:2])
    return float((math.hypot(data.qvel[3], data.qvel[4]) / first) ** (1 / _STEPS))


def _growth(name: str, z: float) -> ScalarCheck:
    return ScalarCheck(
        f"growth of the transverse velocity in a step, hΩ = {z:g}",
        "",
        lambda integrator: transverse_growth(integrator, z),
        lambda integrator: measured_growth(name, integrator, z),
        "√(1+z²), 1/√(1+z²), |R(iz)|",
        precision=1e-8,
    )


def _free_problem(name: str) -> Problem:
    top = TOPS[name]
    title, mjcf, scenario = _FREE_BODIES[name]
    return Problem(
        name=name,
        title=title,
        case=3,
        mjcf=mjcf,
        scenario=scenario,
        position_bound=1.5,
        velocity_bound=10 * abs(top.omega[2]),
        reference=top_reference(top),
        timesteps=divisions(0.05, 40, 60, 80, 120, 160, 320, 640, 1280),
        checks=tuple(_growth(name, z) for z in (0.03, 0.1, 0.3)),
        limit=lambda integrator: _limit(top, integrator),
        growth=lambda integrator, step: measured_growth(name, integrator, step * abs(top.rate)),
        search=(1e-2 / abs(top.rate), 1e1 / abs(top.rate)),
        span=100.0,
        energy_conserved=True,
        momentum_conserved=True,
        note=NEVER_STABLE,
    )


class HeavyTop(Struct, frozen=True):
    """Lagrange's top, let go with spin only."""

    gravity: float
    mass: float
    height: float
    """m, from the pivot to the centre of mass."""
    axial: float
    """Moment about the axis, kg m²."""
    central: float
    """Moment across it through the centre of mass, kg m²."""
    spin: float
    tilt: float
    """From the vertical, rad."""

    def _terms(self) -> tuple[float, float, float, float, float]:
        """a, u₀, how deep u falls, the rate and the parameter of the elliptic functions."""
        transverse = self.central + self.mass * self.height**2
        a, u0 = self.axial * self.spin / transverse, math.cos(self.tilt)
        beta = 2 * self.mass * self.gravity * self.height / transverse
        root = math.sqrt(a**4 - 4 * beta * (a**2 * u0 - beta))
        low, high = 2 * (a**2 * u0 - beta) / (a**2 + root), (a**2 + root) / (2 * beta)
        depth = beta * (1 - low**2) / a**2  # u₀ − low, without a difference of near numbers
        return a, u0, depth, math.sqrt(beta * (high - low)) / 2, (u0 - low) / (high - low)

    def _fall(self, times: Array) -> tuple[Array, Array]:
        """u₀ − u (n,) and its rate (n,) 1/s."""
        from scipy.special import ellipj

        _, _, depth, rate, m = self._terms()
        sn, cn, dn, _ = ellipj(rate * times, m)
        # 1 − cd² = (1 − m) sd²
        fallen = depth * (1 - m) * (sn / dn) ** 2
        return fallen, depth * (1 - m) * 2 * sn * cn / dn**3 * rate

    def _precession_rate(self, times: Array) -> Array:
        a, u0, *_ = self._terms()
        fallen, _ = self._fall(times)
        rate: Array = a * fallen / (1 - (u0 - fallen) ** 2)
        return rate

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        _, u0, _, rate, _ = self._terms()
        fallen, sinking = self._fall(times)
        u = u0 - fallen
        sine = np.sqrt(1 - u * u)
        precession_rate = self._precession_rate(times)
        precession = cumulative_integral(self._precession_rate, times, 0.3 / rate)
        spin_angle = self.spin * times - cumulative_integral(
            lambda at: self._precession_rate(at) * (u0 - self._fall(at)[0]), times, 0.3 / rate
        )
        tilted = quat_mul(
            axis_angle_to_quat(_Z, precession), axis_angle_to_quat(_Y, np.arctan2(sine, u))
        )
        attitude = quat_mul(tilted, axis_angle_to_quat(_Z, spin_angle))
        nod = sinking / sine
        omega = np.stack(
            [
                -precession_rate * sine * np.cos(spin_angle) + nod * np.sin(spin_angle),
                precession_rate * sine * np.sin(spin_angle) + nod * np.cos(spin_angle),
                np.full_like(times, self.spin),
            ],
            axis=1,
        )
        return Motion(times, np.empty((len(times), 0)), attitude[:, None], omega)


_TOP = HeavyTop(gravity=9.81, mass=0.5, height=0.06, axial=4e-4, central=3e-4, spin=250.0, tilt=0.5)
