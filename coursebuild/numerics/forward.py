"""A reference for smooth scenes: MuJoCo's accelerations, another integration.

Entry points: `forward_motion(mjcf, scenario, times)`; `forward_states(model, setup, times, method)`
for any model and method; `tends_to`, whether the engine in small steps does the same.

`mj_forward` gives the acceleration of a state; the state is then integrated in positions, plain
quaternions, velocities and activations, by scipy's DOP853 or another method. It shares the engine's
model, and nothing of its integrators. Commands are held: the integration begins anew when one
changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import mujoco
import numpy as np

from coursebuild.numerics.engine import (
    EngineStates,
    compile_model,
    coordinates,
    initial_data,
    motion_of,
    simulate,
    with_integrator,
)
from coursebuild.numerics.integrate import NoConvergenceError, Rate, State, dop853
from coursebuild.numerics.pilot import position_distances
from coursebuild.numerics.problem import Array, Integrator, Motion, Scenario, Setup

AGREEMENT = 1e-6
"""How near the engine must come, in rad or relative to the extent, unless smaller steps bring it
nearer."""
NEARER = 0.75
"""The part of a difference that half the timestep may leave: half in first order, and some room."""
_PARTS = (2, 4, 8)
"""Parts of the timestep that are tried: the longer ones may be too long for any order to show."""

Method: TypeAlias = Callable[[Rate, State, Array], State]
"""A rate, a first state (d,) and rising times (n,) → the states (n, d)."""


def forward_motion(mjcf: str, scenario: Scenario, times: Array) -> Motion:
    """The motion of a smooth scene at the rising times (n,) s.

    Raises:
        ValueError: the MJCF is wrong.
        NoConvergenceError: the scene is not smooth.
    """
    model = compile_model(mjcf, Integrator.EULER, 1e-3)
    return motion_of(model, forward_states(model, scenario, times, dop853))


def forward_states(
    model: Any,
    scenario: Scenario,
    times: Array,
    method: Method,
    *,
    evaluations: float = math.inf,
) -> EngineStates:
    """The states of a smooth scene at the rising times (n,) s.

    `evaluations`: the most accelerations to compute.

    Raises:
        NoConvergenceError: the scene is not smooth, or it takes more evaluations.
    """
    data = initial_data(scenario, model)
    state = np.concatenate([data.qpos, data.qvel, data.act])
    rate = _rate(model, data, evaluations)
    states = np.empty((len(times), len(state)))
    for begin, end, command in scenario.holds(float(times[-1])):
        if command:
            data.ctrl[:] = command
        selected = (times > begin + 1e-12) & (times <= end + 1e-12)
        offsets = np.append(times[selected] - begin, end - begin)
        part = method(rate, state, np.maximum.accumulate(offsets))
        states[selected] = part[:-1]
        state = part[-1]
    nq, nv = int(model.nq), int(model.nv)
    qpos = states[:, :nq].copy()
    for at in coordinates(model)[1]:
        qpos[:, at : at + 4] /= np.linalg.norm(qpos[:, at : at + 4], axis=1, keepdims=True)
    return EngineStates(times, qpos, states[:, nq : nq + nv].copy(), states[:, nq + nv :].copy())


def _rate(model: Any, data: Any, evaluations: float) -> Rate:
    """d(qpos, qvel, act)/dt of a state (nq + nv + na,), for so many evaluations at most."""
    nq, end = int(model.nq), int(model.nq + model.nv)
    places, turns = coordinates(model)
    turning = np.isin(model.jnt_type, _TURNING_JOINTS)
    # A free joint has three velocities of its place before those that turn it.
    is_free = model.jnt_type[turning] == mujoco.mjtJoint.mjJNT_FREE
    first = (model.jnt_dofadr[turning] + 3 * is_free).tolist()
    moves = np.setdiff1d(np.arange(model.nv), [dof + k for dof in first for k in range(3)])
    count = 0

    def rate(state: State) -> State:
        nonlocal count
        count += 1
        if count > evaluations:
            raise NoConvergenceError(f"it takes more than {evaluations:g} evaluations")
        slope = np.empty_like(state)
        qvel = state[nq:end]
        data.qpos[:] = state[:nq]
        data.qvel[:] = qvel
        data.act[:] = state[end:]
        for at in turns:  # the engine normalizes some of them, in some places
            data.qpos[at : at + 4] /= np.linalg.norm(data.qpos[at : at + 4])
        mujoco.mj_forward(model, data)
        slope[places] = qvel[moves]
        for at, dof in zip(turns, first, strict=True):
            half = qvel[dof : dof + 3] / 2
            mujoco.mju_mulQuatAxis(slope[at : at + 4], state[at : at + 4], half)
        slope[nq:end] = data.qacc
        slope[end:] = data.act_dot
        return slope

    return rate


_TURNING_JOINTS = (int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL))


def tends_to(model: Any, setup: Setup, states: EngineStates, step: float, parting: float) -> bool:
    """Whether the engine comes nearer to these states, the smaller its steps are.

    Two integrations over the same accelerations agree also where these are not the engine's own, as
    of an activation that only a step clamps.

    Args:
        model: `mjModel`; it is not changed.
        setup: the scenario, as long as the states.
        states: at its samples.
        step: s; the longest to try.
        parting: the difference at which motions are compared, where it grows beyond: later they
            have nothing in common, however small the steps.
    """
    before = _gaps(model, setup, states, step)
    if before.max() <= AGREEMENT:
        return True
    for part in _PARTS:
        now = _gaps(model, setup, states, step / part)
        parted = np.flatnonzero(before > parting)
        at = int(parted[0]) if parted.size else int(np.argmax(before))
        if now[at] <= max(NEARER * before[at], AGREEMENT):
            return True
        before = now
    return False


def _gaps(model: Any, setup: Setup, states: EngineStates, step: float) -> Array:
    """The distance of the engine from the states at each sample: (n,); see `position_distance`."""
    for integrator in (Integrator.RK4, Integrator.IMPLICITFAST):
        try:
            engine_states = simulate(setup, with_integrator(model, integrator, step)).states
        except mujoco.FatalError:  # it does not run with everything
            continue
        if np.isfinite(engine_states.qpos).all():
            return position_distances(model, engine_states.qpos, states.qpos)
    return np.full(len(states.times), np.inf)
