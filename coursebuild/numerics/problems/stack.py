"""Case 9: a heavy body on a light one; how deep soft contacts give way.

Entry point: `problems()`; `RestingStack` is the closed form.

At rest a contact's force f gives way by r = f (1 − d) Â/(k d²), with the impedance d, the stiffness
k = 1/(d² timeconst² dampratio²) and Â, the sum of the inverse masses that it connects: whatever the
bodies weigh, the depth grows with their ratio.

Source: MuJoCo documentation, Computation, Constraint model.
"""

from __future__ import annotations

from typing import Any

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
    Sizes,
)
from coursebuild.numerics.problems.common import model_text, motion_without_attitude, run_steps

RATIOS = (1.0, 1e1, 1e2, 1e3, 1e4)
"""Mass of the upper body in kg; the lower one has 1 kg."""
_RESTS = {
    1.0: (-3.1392e-06, -6.2784e-06),
    1e1: (-1.726560e-05, -3.453120e-05),
    1e2: (-1.585296e-04, -3.170592e-04),
    1e3: (-1.5711696e-03, -3.1423392e-03),
    1e4: (-1.56975696e-02, -3.13951392e-02),
}
"""By that mass, where the balls rest, m: the scenarios begin there."""
_SETTLING = 3.0


def mjcf(ratio: float) -> str:
    """Two balls that slide up and down over a floor."""
    contact = 'condim="1" solref="0.004 1" solimp="0.99 0.99 0.001 0.5 2"'
    plane = f'    <geom type="plane" size="1 1 1" {contact}/>'
    balls = [
        f'    <body pos="0 0 {height}"><joint type="slide" axis="0 0 1"/>'
        f'<geom size="0.1" mass="{mass:g}" {contact}/></body>'
        for height, mass in (("0.1", 1.0), ("0.3", ratio))
    ]
    option = 'gravity="0 0 -9.81" tolerance="0" iterations="200"'
    return model_text("\n".join((plane, *balls)), option)


class RestingStack(Struct, frozen=True):
    """A stack at rest, sunk as deep as its contacts give way."""

    upper: float
    lower: float = 1.0
    gravity: float = 9.81
    impedance: float = 0.99
    timeconst: float = 0.004

    @property
    def depths(self) -> Array:
        """The depths of the lower and the upper contact, (2,) m."""
        forces = self.gravity * np.array([self.lower + self.upper, self.upper])
        inverse = np.array([1 / self.lower, 1 / self.lower + 1 / self.upper])
        depths: Array = forces * inverse * (1 - self.impedance) * self.timeconst**2
        return depths

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        still = np.zeros((len(times), 2))
        return motion_without_attitude(times, still - np.cumsum(self.depths), still)


def _settle(integrator: Integrator, ratio: float) -> Any:
    """`mjData` of the stack, let go without overlap and left to itself for a while."""
    scenario = Scenario(1.0, 0.1, (0.0, 0.0))
    return run_steps(mjcf(ratio), scenario, integrator, 1e-3, round(_SETTLING / 1e-3))


def problems() -> tuple[Problem, ...]:
    """One for each ratio."""
    return tuple(_problem(ratio) for ratio in RATIOS)


def _problem(ratio: float) -> Problem:
    solution = RestingStack(ratio)
    depth = solution.depths.sum()
    return Problem(
        name=f"stack-{ratio:g}",
        title=f"Stack of 1 kg under {ratio:g} kg",
        case=9,
        mjcf=mjcf(ratio),
        scenario=Scenario(0.2, 0.002, _RESTS[ratio]),
        position_bound=1.0,
        velocity_bound=10.0,
        reference=Reference("closed", "r = f (1 − d) Â/(k d²)", solution),
        precision=Sizes(1e-13, 0.0, 1e-11),
        timesteps=(2e-3, 1e-3, 5e-4),
        checks=(
            ScalarCheck(
                f"how far the upper body sinks, let go without overlap, {_SETTLING:g} s at 1 ms",
                "m",
                float(depth),
                # Contacts would not say it of balls that passed each other.
                lambda integrator: float(-_settle(integrator, ratio).qpos[1]),
                "r = f (1 − d) Â/(k d²), both contacts",
            ),
            ScalarCheck(
                "velocity that is left then",
                "m/s",
                0.0,
                lambda integrator: float(np.max(np.abs(_settle(integrator, ratio).qvel))),
                "at rest",
            ),
        ),
        smooth=False,
        penetration_bound=0.05,
        note="rigid bodies would not sink at all: the depth is the error of the soft model",
    )
