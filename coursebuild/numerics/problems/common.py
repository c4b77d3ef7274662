"""What the hard cases share: their models' text, simulating for a while, motions of free bodies.

Entry points: `model_text`, `simulated`, `divisions`; `motion_without_attitude`, `free_body_motion`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from coursebuild.numerics.engine import advance, compiled, initial_data
from coursebuild.numerics.integrate import State, bulirsch_stoer, quaternion_rate
from coursebuild.numerics.problem import Array, Integrator, Motion, Scenario, Setup

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
    data = initial_data(Setup(scenario=scenario), model)
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


def free_body_motion(inertia: Array, omega: Array, times: Array) -> Motion:
    """A body that turns freely about its resting centre, integrated: ω(0) (3,) in its frame, rad/s.

    `inertia`: its principal moments (3,), kg m². At the beginning its axes are the world's.
    Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 5.5 (Euler's equations).
    """
    i1, i2, i3 = inertia.tolist()

    def rate(state: State) -> State:
        w1, w2, w3 = state[4:].tolist()
        euler = (i2 - i3) / i1 * w2 * w3, (i3 - i1) / i2 * w3 * w1, (i1 - i2) / i3 * w1 * w2
        return np.concatenate([quaternion_rate(state[:4], state[4:]), euler])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], omega])
    return turning_at_rest(times, *attitude_and_spin(bulirsch_stoer(rate, start, times)))


def attitude_and_spin(states: State) -> tuple[Array, Array]:
    """Unit quaternions (n, 4) and angular velocities (n, 3) of integrated states (n, 7)."""
    return states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True), states[:, 4:]
