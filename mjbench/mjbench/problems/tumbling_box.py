"""Case 1: a box that turns about its intermediate axis, and flips (Dzhanibekov's effect).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, § 37: angular velocities by Jacobi's elliptic
functions, the precession about the angular momentum by a quadrature.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.integrate import cumulative_integral
from mjbench.problem import (
    NO_CONTACT,
    NO_GRAVITY,
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
    divisions,
    model_text,
    turning_at_rest,
)
from mjbench.problems.tops import NEVER_STABLE
from mjbench.simulation import advance, compile_model, initial_data, run_steps

SPIN = 6.0
"""rad/s about the intermediate axis."""
NUDGES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""rad/s about the axis of the least moment."""

MJCF = model_text(
    '    <body><freejoint/><geom type="box" size="0.1 0.05 0.02" mass="1"/></body>',
    NO_GRAVITY,
    NO_CONTACT,
)


class Tumbling(Struct, frozen=True):
    """Free rotation of a body with moments I₁ < I₂ < I₃, begun with ω = (nudge, spin, 0)."""

    nudge: float
    """rad/s, not 0: with 0 the body turns about its axis forever, and any rounding ends that."""
    spin: float = SPIN
    half_sizes: tuple[float, float, float] = (0.1, 0.05, 0.02)

    @property
    def moments(self) -> Array:
        """The principal moments of 1 kg about its centre, (3,) kg m², rising."""
        a, b, c = self.half_sizes
        return np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 3

    @property
    def momentum(self) -> float:
        """Size of the angular momentum, kg m²/s."""
        i1, i2, _ = self.moments
        return math.hypot(i1 * self.nudge, i2 * self.spin)

    @property
    def rate(self) -> float:
        """λ, rad/s: what time is multiplied by in the elliptic functions."""
        i1, i2, i3 = self.moments
        return math.sqrt(self._a2() * (i3 - i1) * (i2 - i1) / (i2 * i3))

    @property
    def complement(self) -> float:
        """1 − m; formed without a difference of large numbers, since it is tiny."""
        i1, i2, i3 = self.moments
        spin = i2 * (i3 - i2) * self.spin**2 + i1 * (i3 - i1) * self.nudge**2  # 2 E I₃ − L²
        return float(i1 * (i3 - i1) * self.nudge**2 / spin)

    def _a2(self) -> float:
        """The square of the largest ω₁."""
        i1, i2, i3 = self.moments
        return float(i2 * (i3 - i2) * self.spin**2 / (i1 * (i3 - i1)) + self.nudge**2)

    @property
    def first_crossing(self) -> float:
        """When ω₂ is first 0, s: a quarter of the period."""
        from scipy.special import ellipkm1

        return float(ellipkm1(self.complement)) / self.rate

    @property
    def flip_interval(self) -> float:
        """From one flip to the next, s: 2 K(m)/λ."""
        return 2 * self.first_crossing

    def omega(self, times: Array) -> Array:
        """Angular velocity in the body's frame (n, 3), rad/s."""
        from scipy.special import ellipj

        i1, i2, i3 = self.moments
        sn, cn, dn, _ = ellipj(self.rate * times, 1 - self.complement)
        # Landau's motion a quarter of a period later: dn, sn, cn have become k' nd, cd and −k' sd.
        third = -self.spin * math.sqrt(i2 * (i2 - i1) / (i3 * (i3 - i1)) * self.complement)
        return np.stack([self.nudge / dn, self.spin * cn / dn, third * sn / dn], axis=1)

    def attitude(self, times: Array) -> Array:
        """Quaternions (n, 4), body to world; at the beginning the identity."""
        from scipy.spatial.transform import Rotation

        angles = self._precession(times)
        start = self._frame(np.zeros(1), np.zeros(1))[0]
        turns = Rotation.from_matrix(start.T @ self._frame(times, angles))
        quats: Array = turns.as_quat(canonical=True, scalar_first=True)
        return quats

    def _frame(self, times: Array, angles: Array) -> Array:
        """Rotation matrices (n, 3, 3) from the body to a frame whose z is the angular momentum.

        Two triads of the same three directions, in both frames: L, L × e₁ and their product.
        """
        i = self.moments
        momentum_axis = self.omega(times) * i
        momentum_axis /= np.linalg.norm(momentum_axis, axis=1, keepdims=True)
        normal = np.cross(momentum_axis, np.array([1.0, 0.0, 0.0]))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        body = np.stack([momentum_axis, normal, np.cross(momentum_axis, normal)], axis=2)
        z = np.broadcast_to(np.array([0.0, 0.0, 1.0]), momentum_axis.shape)
        node = np.stack([-np.sin(angles), np.cos(angles), np.zeros_like(angles)], axis=1)
        world = np.stack([z, node, np.cross(z, node)], axis=2)
        rotations: Array = world @ np.swapaxes(body, 1, 2)
        return rotations

    def _precession(self, times: Array) -> Array:
        """How far the axis of the least moment has gone about L (n,), rad: Gauss's quadrature.

        It goes at L (I₂ω₂² + I₃ω₃²)/(I₂²ω₂² + I₃²ω₃²).
        """
        _, i2, i3 = self.moments

        def speed(at: Array) -> Array:
            omega = self.omega(at)
            second, third = i2 * omega[:, 1] ** 2, i3 * omega[:, 2] ** 2
            rates: Array = self.momentum * (second + third) / (i2 * second + i3 * third)
            return rates

        return cumulative_integral(speed, times, 0.5 / self.rate)

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        return turning_at_rest(times, self.attitude(times), self.omega(times))


def measured_crossing(integrator: Integrator, nudge: float) -> float:
    """When a simulation first has ω₂ = 0, s: by Hermite's cubic within the step that crosses."""
    from scipy.interpolate import CubicHermiteSpline
    from scipy.optimize import brentq

    nudged, timestep = _with_nudge(nudge), 2e-3
    model = compile_model(nudged.mjcf, integrator, timestep)
    data = initial_data(nudged.scenario, model)
    mujoco.mj_forward(model, data)
    before, slope = float(data.qvel[4]), float(data.qacc[4])
    for step in range(round(4 * Tumbling(nudge).first_crossing / timestep)):
        advance(model, data)
        mujoco.mj_forward(model, data)
        after, slope_after = float(data.qvel[4]), float(data.qacc[4])
        if after <= 0.0:
            ends = [step * timestep, (step + 1) * timestep]
            curve = CubicHermiteSpline(ends, [before, after], [slope, slope_after])
            return float(brentq(curve, *ends, xtol=1e-15))
        before, slope = after, slope_after
    return math.inf


def kinetic_drift(integrator: Integrator) -> float:
    """Change of the kinetic energy over 20 s at 2 ms, begun with 1e-3 rad/s beside 6, in percent.

    The last states after some flips depend on the last digit of the first one; this does not.
    """
    nudge = 1e-3
    nudged = _with_nudge(nudge)
    data = run_steps(nudged.mjcf, nudged.scenario, integrator, 2e-3, 10_000)
    inertia = Tumbling(nudge).moments
    final = float(inertia @ np.array(data.qvel[3:]) ** 2)
    first = float(inertia @ np.array(nudged.scenario.qvel[3:]) ** 2)
    return 100 * (final / first - 1)


def _with_nudge(nudge: float) -> Problem:
    base = problem()
    return replace(base, scenario=replace(base.scenario, qvel=(0, 0, 0, nudge, SPIN, 0)))


def problem() -> Problem:
    """The tumbling box with a nudge of 0.1 rad/s over its first flip.

    Orders can be seen there. After a flip that began with a nudge ε, the state has lost a factor of
    (spin/ε)² of its digits, so that with 1e-3 every simulation in double precision is off by 1e-6.
    """
    return Problem(
        name="tumbling-box",
        title="Tumbling box: rotation about the intermediate axis",
        case=1,
        mjcf=MJCF,
        scenario=Scenario(2.0, 0.1, qvel=(0.0, 0.0, 0.0, 0.1, 6.0, 0.0)),
        position_bound=1.5,
        velocity_bound=20 * SPIN,
        reference=Reference(
            "closed",
            "Landau & Lifshitz, Mechanics, § 37 (Jacobi's elliptic functions, a quadrature)",
            Tumbling(0.1),
        ),
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160, 320, 640),
        checks=(
            ScalarCheck(
                "change of the kinetic energy over 20 s at 2 ms",
                "%",
                0.0,
                kinetic_drift,
                "no torque acts",
                precision=1e-8,
                precise=(Integrator.RK4,),
            ),
            *(_flip(nudge) for nudge in NUDGES),
        ),
        search=(1e-4, 1.0),
        span=100.0,
        energy_conserved=True,
        momentum_conserved=True,
        note=NEVER_STABLE,
    )


def _flip(nudge: float) -> ScalarCheck:
    return ScalarCheck(
        f"flip interval after a nudge of {nudge:g} rad/s, at 2 ms",
        "s",
        Tumbling(nudge).flip_interval,
        lambda integrator: 2 * measured_crossing(integrator, nudge),
        "2 K(m)/λ",
        (Integrator.EULER, Integrator.IMPLICITFAST, Integrator.RK4),
        precision=1e-9,
        precise=(Integrator.RK4,),
    )
