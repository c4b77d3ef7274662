"""Case 3, with gravity: Lagrange's top on a ball joint, at 250 rad/s.

Entry point: `problem()`; `motion` is the closed form.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 5.7. Let go at a tilt with
spin only, u = cos θ obeys u′² = (u₀ − u)(β(1 − u²) − a²(u₀ − u)): u oscillates between u₀ and the
lower root as Jacobi's cd²; precession and spin are quadratures.
"""

from __future__ import annotations

import math

import numpy as np

from coursebuild.numerics.elliptic import jacobi
from coursebuild.numerics.integrate import (
    State,
    bulirsch_stoer,
    cumulative_integral,
    quaternion_rate,
)
from coursebuild.numerics.problem import Array, Motion, Problem, Reference, Scenario
from coursebuild.numerics.problems.common import NO_CONTACT
from mjcourse.spatial import axis_angle_to_quat, quat_mul

GRAVITY, MASS, HEIGHT = 9.81, 0.5, 0.06
"""m/s², kg, and m from the pivot to the centre of mass."""
AXIAL, CENTRAL = 4e-4, 3e-4
"""Moments about the axis and across it through the centre of mass, kg m²."""
TRANSVERSE = CENTRAL + MASS * HEIGHT**2
SPIN, TILT = 250.0, 0.5
"""rad/s and rad."""

MJCF = f"""\
<mujoco>
  <option gravity="0 0 -{GRAVITY}">{NO_CONTACT}</option>
  <worldbody>
    <body>
      <joint type="ball"/>
      <inertial pos="0 0 {HEIGHT}" mass="{MASS}" diaginertia="{CENTRAL} {CENTRAL} {AXIAL}"/>
    </body>
  </worldbody>
</mujoco>
"""

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


def motion(times: Array) -> Motion:
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
    z, y = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    attitude = quat_mul(
        quat_mul(axis_angle_to_quat(z, precession), axis_angle_to_quat(y, tilt)),
        axis_angle_to_quat(z, own),
    )
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


def integrated(times: Array) -> Motion:
    """Euler's equations about the pivot with the torque of gravity, by Bulirsch–Stoer."""
    load = MASS * GRAVITY * HEIGHT

    def rate(state: State) -> State:
        q0, q1, q2, q3, w1, w2, w3 = state.tolist()
        # The vertical in the body's frame: the third row of the rotation matrix.
        vx, vy = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1)
        euler = (
            ((TRANSVERSE - AXIAL) * w2 * w3 + load * vy) / TRANSVERSE,
            ((AXIAL - TRANSVERSE) * w3 * w1 - load * vx) / TRANSVERSE,
            0.0,
        )
        return np.concatenate([quaternion_rate(state[:4], state[4:]), euler])

    start = np.array([math.cos(TILT / 2), 0, math.sin(TILT / 2), 0, 0, 0, SPIN])
    states = bulirsch_stoer(rate, start, times)
    attitude = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    return Motion(times, np.empty((len(times), 0)), attitude[:, None], states[:, 4:])


def problem() -> Problem:
    """Half a second of the top, let go with spin only."""
    return Problem(
        name="heavy-top",
        title="Heavy top on a ball joint, 250 rad/s",
        case=3,
        mjcf=MJCF,
        scenario=Scenario(0.5, 0.02, (math.cos(TILT / 2), 0, math.sin(TILT / 2), 0), (0, 0, SPIN)),
        position_bound=1.5,
        velocity_bound=4 * SPIN,
        reference=Reference(
            "closed", "Lagrange's top, Goldstein, 5.7, with quadratures", motion, floor=1e-12
        ),
        second=Reference(
            "ode", "Euler's equations and quaternions, Bulirsch–Stoer", integrated, floor=1e-11
        ),
        timesteps=tuple(0.02 / n for n in (40, 80, 160, 320, 640, 1280)),
        search=(1e-5, 1.0),
        energy_conserved=True,
        note="Euler is stable at no timestep: what is measured is where 10 000 steps show it",
    )
