"""Case 2: a pendulum let go at 90° and at 179°, as a hinge, as a ball joint and held by `connect`.

Entry point: `problems()`; `Swing` is the closed form.

The last one's error is that of the soft constraint: it does not go away with the timestep.

Source: Abramowitz & Stegun, 17.1 and 16.1; L. D. Landau, E. M. Lifshitz, Mechanics, § 11:
sin(θ/2) = k cd(ω₀t | k²) for a pendulum let go at rest, k = sin(θ₀/2).
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.integrate import forward_motion
from coursebuild.numerics.problem import (
    Array,
    Motion,
    Problem,
    Reference,
    Scenario,
    SecondReference,
)
from coursebuild.numerics.problems.common import (
    NO_CONTACT,
    divisions,
    model_text,
    motion_without_attitude,
    turning_at_rest,
)
from mjcourse.spatial import axis_angle_to_quat

Kind = Literal["hinge", "ball", "connect"]
_AXIS = np.array([0.0, 1.0, 0.0])
_JOINTS = {
    "hinge": '<joint type="hinge" axis="0 1 0"/>',
    "ball": '<joint type="ball"/>',
    "connect": "<freejoint/>",
}
_PIVOT = '  <equality><connect body1="bob" anchor="0 0 0"/></equality>\n'
_STARTS = {
    90: ((1.5707963267948966,), (0.7071067811865476, 0.0, 0.7071067811865475, 0.0)),
    179: ((3.12413936106985,), (0.00872653549837393, 0.0, 0.9999619230641713, 0.0)),
}
"""By degrees, the angle of the hinge in rad, and the quaternion of the ball."""


def mjcf(kind: Kind) -> str:
    """A bob below a pivot at the origin; turns are about y."""
    inertial = '<inertial pos="0 0 -1" mass="1" diaginertia="0.01 0.01 0.01"/>'
    return model_text(
        f'    <body name="bob">{_JOINTS[kind]}{inertial}</body>',
        'gravity="0 0 -9.81"',
        NO_CONTACT,
        _PIVOT if kind == "connect" else "",
    )


class Swing(Struct, frozen=True):
    """The swing of a pendulum that is let go at rest."""

    kind: Kind
    begin: float
    """rad, between 0 and π."""
    gravity: float = 9.81
    length: float = 1.0
    """m, from the pivot to the centre of mass."""
    mass: float = 1.0
    inertia: float = 0.01
    """About the centre of mass, kg m²."""

    @property
    def rate(self) -> float:
        """Of small swings, rad/s."""
        moment = self.inertia + self.mass * self.length**2
        return math.sqrt(self.mass * self.gravity * self.length / moment)

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        from scipy.special import ellipj

        k, k1 = math.sin(self.begin / 2), math.cos(self.begin / 2)
        sn, cn, dn, _ = ellipj(self.rate * times, k * k)
        # The cosine beside the sine: near the top the sine alone would lose half of the digits.
        angle = 2 * np.arctan2(k * cn / dn, k1 / dn)
        return _as_motion(self.kind, times, angle, -2 * k * self.rate * k1 * sn / dn)


def _as_motion(kind: Kind, times: Array, angle: Array, rate: Array) -> Motion:
    """The motion of an angle (n,) rad with its rate (n,) rad/s."""
    if kind == "hinge":
        return motion_without_attitude(times, angle[:, None], rate[:, None])
    attitude = axis_angle_to_quat(_AXIS, angle)[:, None]
    turning = rate[:, None] * _AXIS
    if kind == "ball":
        return Motion(times, np.empty((len(times), 0)), attitude, turning)
    return turning_at_rest(times, attitude[:, 0], turning)


def _held_motion(text: str, scenario: Scenario, times: Array) -> Motion:
    """The motion of the free body if its soft pivot were rigid."""
    ball = text.replace(_PIVOT, "").replace(_JOINTS["connect"], _JOINTS["ball"])
    motion = forward_motion(ball, replace(scenario, qpos=scenario.qpos[3:]), times)
    return turning_at_rest(times, motion.attitude[:, 0], motion.velocity)


RIGID_PIVOT = SecondReference("MuJoCo’s accelerations with a ball joint, DOP853", _held_motion)


def problems() -> tuple[Problem, ...]:
    """Each kind from each angle."""
    kinds: tuple[Kind, ...] = ("hinge", "ball", "connect")
    return tuple(_problem(kind, degrees) for kind in kinds for degrees in (90, 179))


def _problem(kind: Kind, degrees: int) -> Problem:
    angle, quaternion = _STARTS[degrees]
    start = {"hinge": angle, "ball": quaternion, "connect": (0.0, 0.0, 0.0, *quaternion)}[kind]
    source = "Jacobi's elliptic functions, Landau & Lifshitz, Mechanics, § 11"
    return Problem(
        name=f"pendulum-{kind}-{degrees}",
        title=f"Pendulum from {degrees}°, {_SUSPENSIONS[kind]}",
        case=2,
        mjcf=mjcf(kind),
        scenario=Scenario(4.0, 0.1, start),
        position_bound=math.pi,
        velocity_bound=8.0,
        reference=Reference("closed", source, Swing(kind, math.radians(degrees))),
        second=RIGID_PIVOT if kind == "connect" else None,
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160),
        search=None if kind == "connect" else (1e-3, 3.0),
        span=500.0,
        smooth=kind != "connect",
        energy_conserved=True,
        note=_NOTES[kind],
    )


_SUSPENSIONS = {
    "hinge": "a hinge",
    "ball": "a ball joint",
    "connect": "a free body held by connect",
}
_NOTES = {
    "hinge": "let go at rest it never goes round: beyond the boundary it does",
    "ball": "let go at rest it never goes round: beyond the boundary it does",
    "connect": "the error is that of the soft constraint, and does not go away with the timestep",
}
