"""Parts that the hard cases share: their models' text, simulating for a while, motions.

Entry points: `model_text`, `run_steps`, `divisions`; `motion_without_attitude`, `turning_at_rest`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from coursebuild.numerics.engine import advance, compile_model, initial_data
from coursebuild.numerics.problem import Array, Integrator, Motion, Scenario

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


def run_steps(
    mjcf: str, scenario: Scenario, integrator: Integrator, timestep: float, steps: int
) -> Any:
    """`mjData` after so many steps from where a scenario begins."""
    model = compile_model(mjcf, integrator, timestep)
    data = initial_data(scenario, model)
    advance(model, data, steps)
    return data


def divisions(sample: float, *parts: int) -> tuple[float, ...]:
    """Timesteps that divide a sample, s."""
    return tuple(sample / n for n in parts)


def motion_without_attitude(times: Array, position: Array, velocity: Array) -> Motion:
    """A motion of slides and hinges, with positions (n, p) and velocities (n, v)."""
    return Motion(times, position, np.empty((len(times), 0, 4)), velocity)


def turning_at_rest(times: Array, attitude: Array, omega: Array) -> Motion:
    """A motion of a free body whose centre rests: attitude (n, 4) and rad/s (n, 3)."""
    still = np.zeros((len(times), 3))
    return Motion(times, still, attitude[:, None], np.concatenate([still, omega], axis=1))
