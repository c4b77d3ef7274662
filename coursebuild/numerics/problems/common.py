"""What the hard cases share: their models' text, simulating for a while, a second reference.

Entry points: `model_text`, `simulated`, `divisions`; `motion_without_attitude`, `turning_at_rest`;
`ENGINE`, the second reference of most cases.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from coursebuild.numerics.engine import advance, compiled, initial_data
from coursebuild.numerics.forward import forward_motion
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Scenario,
    SecondReference,
)

NO_CONTACT = '<flag contact="disable"/>'
NO_GRAVITY = 'gravity="0 0 0"'


def model_text(world: str, option: str = "", inner: str = "", rest: str = "") -> str:
    """MJCF of what is in the world, of attributes and elements of `option`, and of other sections.

    It says neither timestep nor integrator.
    """
    return (
        f"<mujoco>\n  <option {option}>{inner}</option>\n"
        f"  <worldbody>\n{world}\n  </worldbody>\n{rest}</mujoco>\n"
    )


def simulated(
    mjcf: str, scenario: Scenario, integrator: Integrator, timestep: float, steps: int
) -> Any:
    """`mjData` after so many steps from where a scenario begins."""
    model = compiled(mjcf, integrator, timestep)
    data = initial_data(scenario, model)
    advance(model, data, steps)
    return data


def divisions(sample: float, *parts: int) -> tuple[float, ...]:
    """Timesteps that divide a sample, s."""
    return tuple(sample / n for n in parts)


def motion_without_attitude(times: Array, position: Array, velocity: Array) -> Motion:
    """Of slides and hinges: positions (n, p) and velocities (n, v)."""
    return Motion(times, position, np.empty((len(times), 0, 4)), velocity)


def turning_at_rest(times: Array, attitude: Array, omega: Array) -> Motion:
    """Of a free body whose centre rests: attitude (n, 4) and angular velocity (n, 3), rad/s."""
    still = np.zeros((len(times), 3))
    return Motion(times, still, attitude[:, None], np.concatenate([still, omega], axis=1))


ENGINE = SecondReference("MuJoCo’s accelerations over the MJCF, DOP853", forward_motion)
"""Shares nothing with MuJoCo's integrators."""
