"""Case 9: a heavy body on a light one; how deep soft contacts give way.

Entry point: `problems()`; `depths` is the closed form.

At rest a contact's force f gives way by r = f (1 − d) Â/(k d²), with the impedance d, the stiffness
k = 1/(d² timeconst² dampratio²) and Â, the sum of the inverse masses that it connects: whatever the
bodies weigh, the depth grows with their ratio.

Source: MuJoCo documentation, Computation, Constraint model.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems.common import (
    engine_reference,
    model_text,
    motion_without_attitude,
    simulated,
)

GRAVITY, RADIUS = 9.81, 0.1
IMPEDANCE, TIMECONST = 0.99, 0.004
RATIOS = (1.0, 1e1, 1e2, 1e3, 1e4)
"""Mass of the upper body in kg; the lower one has 1 kg."""
_SETTLED = 3.0


def mjcf(ratio: float) -> str:
    """Two balls that slide up and down over a floor."""
    contact = f'condim="1" solref="{TIMECONST} 1" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"'
    plane = f'    <geom type="plane" size="1 1 1" {contact}/>'
    balls = [
        f'    <body pos="0 0 {(2 * index + 1) * RADIUS!r}"><joint type="slide" axis="0 0 1"/>'
        f'<geom size="{RADIUS}" mass="{mass!r}" {contact}/></body>'
        for index, mass in enumerate((1.0, ratio))
    ]
    option = f'gravity="0 0 -{GRAVITY}" tolerance="0" iterations="200"'
    return model_text("\n".join((plane, *balls)), option)


def depths(ratio: float) -> Array:
    """How deep the lower and the upper contact give way at rest, (2,) m."""
    compliance = (1 - IMPEDANCE) * TIMECONST**2
    forces = GRAVITY * np.array([1.0 + ratio, ratio])
    found: Array = forces * np.array([1.0, 1.0 + 1.0 / ratio]) * compliance
    return found


def _resting(found: Array, times: Array) -> Motion:
    place = -np.array([found[0], found[0] + found[1]])
    still = np.zeros((len(times), 2))
    return motion_without_attitude(times, still + place, still)


def _settled(integrator: Integrator, ratio: float) -> Any:
    """`mjData` of the stack, let go without overlap and left to itself for a while."""
    scenario = Scenario(1.0, 0.1, (0.0, 0.0))
    return simulated(mjcf(ratio), scenario, integrator, 1e-3, round(_SETTLED / 1e-3))


def _sunk(integrator: Integrator, ratio: float) -> float:
    # Not what the contacts say, which the collision of balls that passed each other would hide.
    return float(-_settled(integrator, ratio).qpos[1])


def _speed(integrator: Integrator, ratio: float) -> float:
    return float(np.max(np.abs(_settled(integrator, ratio).qvel)))


def problems() -> tuple[Problem, ...]:
    """One for each ratio."""
    return tuple(_problem(ratio) for ratio in RATIOS)


def _problem(ratio: float) -> Problem:
    rest = depths(ratio)
    scenario = Scenario(1.0, 0.1, (-float(rest[0]), -float(rest.sum())))
    return Problem(
        name=f"stack-{ratio:g}",
        title=f"Stack of 1 kg under {ratio:g} kg",
        case=9,
        mjcf=mjcf(ratio),
        scenario=scenario,
        position_bound=1.0,
        velocity_bound=10.0,
        reference=Reference(
            "closed",
            "r = f (1 − d) Â/(k d²)",
            lambda times: _resting(depths(ratio), times),
            floor=1e-15,
        ),
        second=engine_reference(mjcf(ratio), scenario),
        timesteps=(2e-3, 1e-3, 5e-4),
        checks=(
            ScalarCheck(
                f"how far the upper body sinks, let go without overlap, {_SETTLED:g} s at 1 ms",
                "m",
                float(rest.sum()),
                lambda integrator: _sunk(integrator, ratio),
                "r = f (1 − d) Â/(k d²), both contacts",
            ),
            ScalarCheck(
                "velocity that is left then",
                "m/s",
                0.0,
                lambda integrator: _speed(integrator, ratio),
                "at rest",
            ),
        ),
        smooth=False,
        penetration_bound=RADIUS / 2,
        note="rigid bodies would not sink at all: the depth is the error of the soft model",
    )
