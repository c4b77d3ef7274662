"""Case 4: a stone thrown without air; the semi-implicit method is wrong by exactly g T h/2.

Entry point: `problem()`.

Source: with v ← v + gh before x ← x + vh, x after n steps is x₀ + v₀nh + gh²n(n + 1)/2.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems.common import NO_CONTACT, divisions, model_text, run_steps

_STEP = 0.01
_SCENARIO = Scenario(1.0, 0.1, qvel=(3.0, 0.0, 4.0, 0.0, 0.0, 0.0))

_STONE = '    <body><freejoint/><geom size="0.05" mass="1"/></body>'
MJCF = model_text(_STONE, 'gravity="0 0 -9.81"', NO_CONTACT)


class Parabola(Struct, frozen=True):
    """x = v₀t + gt²/2, thrown from the origin."""

    launch: tuple[float, float, float]
    gravity: float

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        t = times[:, None]
        launch, fall = np.array(self.launch), np.array([0.0, 0.0, -self.gravity])
        upright = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (len(times), 1, 4))
        velocity = np.concatenate([launch + fall * t, np.zeros((len(times), 3))], axis=1)
        return Motion(times, launch * t + fall * t**2 / 2, upright, velocity)


PARABOLA = Parabola((3.0, 0.0, 4.0), 9.81)


def fall_error(integrator: Integrator) -> float:
    """Error of the height after a second at 10 ms, m: simulated less exact."""
    data = run_steps(MJCF, _SCENARIO, integrator, _STEP, round(1.0 / _STEP))
    return float(data.qpos[2] - PARABOLA.motion(np.ones(1)).position[0, 2])


def exact_error(integrator: Integrator) -> float:
    """The error in theory: −gTh/2 where velocities are stepped first, nothing with RK4."""
    return 0.0 if integrator is Integrator.RK4 else -PARABOLA.gravity * 1.0 * _STEP / 2


def problem() -> Problem:
    """A throw of one second."""
    return Problem(
        name="projectile",
        title="Projectile",
        case=4,
        mjcf=MJCF,
        scenario=_SCENARIO,
        position_bound=100.0,
        velocity_bound=100.0,
        reference=Reference("closed", "x = v₀t + gt²/2", PARABOLA),
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160),
        energy_conserved=True,
        checks=(
            ScalarCheck(
                "error of the height after 1 s at 10 ms", "m", exact_error, fall_error, "−gTh/2"
            ),
        ),
    )
