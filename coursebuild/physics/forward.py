"""A reference for smooth scenes: MuJoCo's accelerations, another integration.

Entry point: `forward_motion(mjcf, scenario, times)`.

`mj_forward` gives the acceleration of a state; the state is then integrated by Bulirsch–Stoer in
positions, plain quaternions and velocities. It shares the engine's model, and nothing of its
integrators. Commands are held: the integration begins anew when one changes.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from coursebuild.physics.engine import compiled, motion_of
from coursebuild.physics.extrapolation import State, integrate
from coursebuild.physics.problem import Array, Integrator, Motion, Scenario


def forward_motion(
    mjcf: str, scenario: Scenario, times: Array, *, tolerance: float = 1e-13
) -> Motion:
    """The motion of a smooth scene at the rising times (n,) s.

    Raises:
        ValueError: the MJCF is wrong.
        NoConvergenceError: the scene is not smooth.
    """
    model = compiled(mjcf, Integrator.EULER, 1e-3)
    data = mujoco.MjData(model)
    state = _start(model, data, scenario)
    rate = _rate(model, data)
    states = np.empty((len(times), len(state)))
    for begin, end, command in _holds(scenario, float(times[-1])):
        data.ctrl[:] = command
        here = (times > begin + 1e-12) & (times <= end + 1e-12)
        offsets = np.append(times[here] - begin, end - begin)
        part = integrate(rate, state, np.maximum.accumulate(offsets), tolerance)
        states[here] = part[:-1]
        state = part[-1]
    nq = int(model.nq)
    qpos = states[:, :nq].copy()
    for at in _quaternions(model):
        qpos[:, at : at + 4] /= np.linalg.norm(qpos[:, at : at + 4], axis=1, keepdims=True)
    return motion_of(model, times, qpos, states[:, nq:])


def _start(model: Any, data: Any, scenario: Scenario) -> State:
    if scenario.qpos:
        data.qpos[:] = scenario.qpos
    if scenario.qvel:
        data.qvel[:] = scenario.qvel
    return np.concatenate([data.qpos, data.qvel])


def _holds(scenario: Scenario, end: float) -> list[tuple[float, float, tuple[float, ...]]]:
    """From when to when which commands hold, s."""
    if not scenario.controls:
        return [(0.0, end, ())]
    found = []
    for index, command in enumerate(scenario.controls):
        begin = index * scenario.hold
        until = begin + scenario.hold if index + 1 < len(scenario.controls) else end
        if begin < end:
            found.append((begin, min(until, end), command))
    return found


def _quaternions(model: Any) -> list[int]:
    """Where quaternions begin in `qpos`."""
    found = []
    for kind, start in zip(model.jnt_type, model.jnt_qposadr, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            found.append(int(start) + 3)
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            found.append(int(start))
    return found


def _rate(model: Any, data: Any) -> Any:
    """d(qpos, qvel)/dt of a state (nq + nv,)."""
    nq = int(model.nq)
    joints = [
        (mujoco.mjtJoint(int(kind)), int(q), int(v))
        for kind, q, v in zip(model.jnt_type, model.jnt_qposadr, model.jnt_dofadr, strict=True)
    ]
    quaternions = _quaternions(model)

    def rate(state: State) -> State:
        slope = np.empty_like(state)
        qvel = state[nq:]
        data.qpos[:] = state[:nq]
        data.qvel[:] = qvel
        for at in quaternions:  # the engine normalizes some of them, in some places
            data.qpos[at : at + 4] /= np.linalg.norm(data.qpos[at : at + 4])
        mujoco.mj_forward(model, data)
        for kind, q, v in joints:
            match kind:
                case mujoco.mjtJoint.mjJNT_FREE:
                    slope[q : q + 3] = qvel[v : v + 3]
                    slope[q + 3 : q + 7] = _turning(state[q + 3 : q + 7], qvel[v + 3 : v + 6])
                case mujoco.mjtJoint.mjJNT_BALL:
                    slope[q : q + 4] = _turning(state[q : q + 4], qvel[v : v + 3])
                case _:
                    slope[q] = qvel[v]
        slope[nq:] = data.qacc
        return slope

    return rate


def _turning(q: Array, omega: Array) -> Array:
    q0, q1, q2, q3 = q.tolist()
    w1, w2, w3 = omega.tolist()
    return np.array(
        [
            (-q1 * w1 - q2 * w2 - q3 * w3) / 2,
            (q0 * w1 + q2 * w3 - q3 * w2) / 2,
            (q0 * w2 + q3 * w1 - q1 * w3) / 2,
            (q0 * w3 + q1 * w2 - q2 * w1) / 2,
        ]
    )
