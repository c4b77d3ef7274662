"""A reference for smooth scenes: MuJoCo's accelerations, another integration.

Entry points: `forward_motion(mjcf, scenario, times)`; `forward_states(model, setup, times, method)`
for any model and method.

`mj_forward` gives the acceleration of a state; the state is then integrated in positions, plain
quaternions, velocities and activations, by Bulirsch–Stoer or another method. It shares the engine's
model, and nothing of its integrators. Commands are held: the integration begins anew when one
changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import begun, compiled, motion_of
from coursebuild.numerics.extrapolation import NoConvergenceError, Rate, State, integrate
from coursebuild.numerics.problem import Array, Integrator, Motion, Scenario, Setup

Method: TypeAlias = Callable[[Rate, State, Array], State]
"""A rate, a first state (d,) and rising times (n,) → the states (n, d)."""


class States(Struct, frozen=True):
    """A motion in the engine's coordinates."""

    times: Array
    """(n,) s."""
    qpos: Array
    """(n, nq)."""
    qvel: Array
    """(n, nv)."""
    act: Array
    """(n, na)."""


class _Unbounded(Struct, frozen=True):
    """A scenario of which nothing is judged."""

    scenario: Scenario
    position_bound: float = float("inf")
    velocity_bound: float = float("inf")
    penetration_bound: float = float("inf")


def forward_motion(
    mjcf: str, scenario: Scenario, times: Array, *, tolerance: float = 1e-13
) -> Motion:
    """The motion of a smooth scene at the rising times (n,) s.

    Raises:
        ValueError: the MJCF is wrong.
        NoConvergenceError: the scene is not smooth.
    """
    model = compiled(mjcf, Integrator.EULER, 1e-3)

    def method(rate: Rate, start: State, offsets: Array) -> State:
        return integrate(rate, start, offsets, tolerance)

    found = forward_states(model, _Unbounded(scenario), times, method)
    return motion_of(model, times, found.qpos, found.qvel)


def forward_states(
    model: Any, setup: Setup, times: Array, method: Method, *, evaluations: float = float("inf")
) -> States:
    """The states of a smooth scene at the rising times (n,) s.

    `evaluations`: the most accelerations to compute.

    Raises:
        NoConvergenceError: the scene is not smooth, or it takes more evaluations.
    """
    data = begun(setup, model)
    state = np.concatenate([data.qpos, data.qvel, data.act])
    rate = _limited(_rate(model, data), evaluations)
    states = np.empty((len(times), len(state)))
    for begin, end, command in _holds(setup.scenario, float(times[-1])):
        if command:
            data.ctrl[:] = command
        here = (times > begin + 1e-12) & (times <= end + 1e-12)
        offsets = np.append(times[here] - begin, end - begin)
        part = method(rate, state, np.maximum.accumulate(offsets))
        states[here] = part[:-1]
        state = part[-1]
    nq, nv = int(model.nq), int(model.nv)
    qpos = states[:, :nq].copy()
    for at in quaternions(model):
        qpos[:, at : at + 4] /= np.linalg.norm(qpos[:, at : at + 4], axis=1, keepdims=True)
    return States(times, qpos, states[:, nq : nq + nv].copy(), states[:, nq + nv :].copy())


def _limited(rate: Rate, evaluations: float) -> Rate:
    done = 0

    def limited(state: State) -> State:
        nonlocal done
        done += 1
        if done > evaluations:
            raise NoConvergenceError(f"it takes more than {evaluations:g} evaluations")
        return rate(state)

    return limited


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


def quaternions(model: Any) -> list[int]:
    """Where quaternions begin in `qpos`."""
    found = []
    for kind, start in zip(model.jnt_type, model.jnt_qposadr, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            found.append(int(start) + 3)
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            found.append(int(start))
    return found


def _rate(model: Any, data: Any) -> Any:
    """d(qpos, qvel, act)/dt of a state (nq + nv + na,)."""
    nq, end = int(model.nq), int(model.nq + model.nv)
    joints = [
        (mujoco.mjtJoint(int(kind)), int(q), int(v))
        for kind, q, v in zip(model.jnt_type, model.jnt_qposadr, model.jnt_dofadr, strict=True)
    ]
    turns = quaternions(model)

    def rate(state: State) -> State:
        slope = np.empty_like(state)
        qvel = state[nq:end]
        data.qpos[:] = state[:nq]
        data.qvel[:] = qvel
        data.act[:] = state[end:]
        for at in turns:  # the engine normalizes some of them, in some places
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
        slope[nq:end] = data.qacc
        slope[end:] = data.act_dot
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
