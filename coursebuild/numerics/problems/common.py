"""What the references of several problems share.

Entry points: `motion_without_attitude`, `free_body_rate`, `free_body_motion`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coursebuild.numerics.extrapolation import State, integrate
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
        q0, q1, q2, q3 = state[:4].tolist()
        return np.array(
            [
                (-q1 * w1 - q2 * w2 - q3 * w3) / 2,
                (q0 * w1 + q2 * w3 - q3 * w2) / 2,
                (q0 * w2 + q3 * w1 - q1 * w3) / 2,
                (q0 * w3 + q1 * w2 - q2 * w1) / 2,
                (i2 - i3) / i1 * w2 * w3,
                (i3 - i1) / i2 * w3 * w1,
                (i1 - i2) / i3 * w1 * w2,
            ]
        )

    return rate


def free_body_motion(inertia: Array, omega: Array, times: Array) -> Motion:
    """A body that turns freely about its resting centre, integrated: ω(0) (3,) in its frame, rad/s.

    At the beginning its axes are the world's.
    """
    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], omega])
    states = integrate(free_body_rate(inertia), start, times)
    attitude = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    still = np.zeros((len(times), 3))
    return Motion(times, still, attitude[:, None], np.concatenate([still, states[:, 4:]], axis=1))
