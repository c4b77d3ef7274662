"""Case 2: a pendulum let go at 90° and at 179°, as a hinge, as a ball joint and held by `connect`.

Entry point: `problems()`; `swing` is the closed form.

The last one's error is that of the soft constraint: it does not go away with the timestep.

Source: Abramowitz & Stegun, 17.1 and 16.1; L. D. Landau, E. M. Lifshitz, Mechanics, § 11:
sin(θ/2) = k cd(ω₀t | k²) for a pendulum let go at rest, k = sin(θ₀/2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from coursebuild.numerics.elliptic import jacobi
from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import Array, Motion, Problem, Reference, Scenario
from coursebuild.numerics.problems.common import (
    NO_CONTACT,
    divisions,
    model_text,
    motion_without_attitude,
    turning_at_rest,
)
from mjcourse.spatial import axis_angle_to_quat

GRAVITY, LENGTH, MASS, INERTIA = 9.81, 1.0, 1.0, 0.01
"""m/s², m, kg, and kg m² about the centre of mass."""
RATE = math.sqrt(MASS * GRAVITY * LENGTH / (INERTIA + MASS * LENGTH**2))
"""Of small swings, rad/s."""
Kind = Literal["hinge", "ball", "connect"]
_AXIS = np.array([0.0, 1.0, 0.0])


def mjcf(kind: Kind) -> str:
    """A bob below a pivot at the origin; turns are about y."""
    joint = {
        "hinge": '<joint type="hinge" axis="0 1 0"/>',
        "ball": '<joint type="ball"/>',
        "connect": "<freejoint/>",
    }[kind]
    inertia = f'diaginertia="{INERTIA} {INERTIA} {INERTIA}"'
    inertial = f'<inertial pos="0 0 -{LENGTH}" mass="{MASS}" {inertia}/>'
    equality = '  <equality><connect body1="bob" anchor="0 0 0"/></equality>\n'
    return model_text(
        f'    <body name="bob">{joint}{inertial}</body>',
        f'gravity="0 0 -{GRAVITY}"',
        NO_CONTACT,
        equality if kind == "connect" else "",
    )


def swing(begin: float, times: Array) -> tuple[Array, Array]:
    """Angle (n,) rad and its rate (n,) rad/s, let go at rest at `begin`, between 0 and π."""
    k, k1 = math.sin(begin / 2), math.cos(begin / 2)
    sn, cn, dn = jacobi(RATE * times, k1 * k1)
    # The cosine beside the sine: near the top the sine alone would lose half of the digits.
    angle = 2 * np.arctan2(k * cn / dn, k1 / dn)
    return angle, -2 * k * RATE * k1 * sn / dn


def integrated(begin: float, times: Array) -> tuple[Array, Array]:
    """The same by Bulirsch–Stoer."""

    def rate(state: State) -> State:
        return np.array([state[1], -(RATE**2) * math.sin(state[0])])

    states = bulirsch_stoer(rate, np.array([begin, 0.0]), times)
    return states[:, 0], states[:, 1]


def _motion(
    kind: Kind, begin: float, form: Callable[[float, Array], tuple[Array, Array]]
) -> Callable[[Array], Motion]:
    def motion(times: Array) -> Motion:
        angle, rate = form(begin, times)
        if kind == "hinge":
            return motion_without_attitude(times, angle[:, None], rate[:, None])
        attitude = axis_angle_to_quat(_AXIS, angle)[:, None]
        turning = rate[:, None] * _AXIS
        if kind == "ball":
            return Motion(times, np.empty((len(times), 0)), attitude, turning)
        return turning_at_rest(times, attitude[:, 0], turning)

    return motion


def problems() -> tuple[Problem, ...]:
    """Each kind from each angle."""
    kinds: tuple[Kind, ...] = ("hinge", "ball", "connect")
    return tuple(_problem(kind, degrees) for kind in kinds for degrees in (90, 179))


def _problem(kind: Kind, degrees: int) -> Problem:
    begin = math.radians(degrees)
    turned = (math.cos(begin / 2), 0.0, math.sin(begin / 2), 0.0)
    start = {"hinge": (begin,), "ball": turned, "connect": (0.0, 0.0, 0.0, *turned)}[kind]
    worse = 1.0 / math.cos(begin / 2)  # by which an error grows on the way down
    return Problem(
        name=f"pendulum-{kind}-{degrees}",
        title=f"Pendulum from {degrees}°, {_SAID[kind]}",
        case=2,
        mjcf=mjcf(kind),
        scenario=Scenario(4.0, 0.1, start),
        position_bound=math.pi,
        velocity_bound=2.5 * RATE,
        reference=Reference(
            "closed",
            "Jacobi's elliptic functions, Landau & Lifshitz, Mechanics, § 11",
            _motion(kind, begin, swing),
            floor=1e-14 * worse,
        ),
        second=Reference(
            "ode",
            "Bulirsch–Stoer",
            _motion(kind, begin, integrated),
            floor=1e-13 * worse,
        ),
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160),
        search=None if kind == "connect" else (1e-3, 3.0),
        span=500.0,
        smooth=kind != "connect",
        energy_conserved=True,
        note=_NOTES[kind],
    )


_SAID = {
    "hinge": "a hinge",
    "ball": "a ball joint",
    "connect": "a free body held by connect",
}
_NOTES = {
    "hinge": "let go at rest it never goes round: beyond the boundary it does",
    "ball": "let go at rest it never goes round: beyond the boundary it does",
    "connect": "the error is that of the soft constraint, and does not go away with the timestep",
}
