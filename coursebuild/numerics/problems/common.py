"""What the references of several problems share.

Entry points: `motion_without_attitude`, `free_body_rate`, `free_body_motion`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coursebuild.numerics.integrate import State, bulirsch_stoer, quaternion_rate
from coursebuild.numerics.problem import Array, Motion

NO_CONTACT = '<flag contact="disable"/>'
NO_GRAVITY = 'gravity="0 0 0"'


def motion_without_attitude(times: Array, position: Array, velocity: Array) -> Motion:
    """Of slides and hinges: positions (n, p) and velocities (n, v)."""
    return Motion(times, position, np.empty((len(times), 0, 4)), velocity)


def free_body_rate(inertia: Array) -> Callable[[State], State]:
    """Euler's equations with the attitude: d(q, ω)/dt of (7,) for principal moments (3,), kg m².

    Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 5.5.
    """
    i1, i2, i3 = inertia.tolist()

    def rate(state: State) -> State:
        w1, w2, w3 = state[4:].tolist()
        euler = (i2 - i3) / i1 * w2 * w3, (i3 - i1) / i2 * w3 * w1, (i1 - i2) / i3 * w1 * w2
        return np.concatenate([quaternion_rate(state[:4], state[4:]), euler])

    return rate


def free_body_motion(inertia: Array, omega: Array, times: Array) -> Motion:
    """A body that turns freely about its resting centre, integrated: ω(0) (3,) in its frame, rad/s.

    At the beginning its axes are the world's.
    """
    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], omega])
    states = bulirsch_stoer(free_body_rate(inertia), start, times)
    attitude = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    still = np.zeros((len(times), 3))
    return Motion(times, still, attitude[:, None], np.concatenate([still, states[:, 4:]], axis=1))
