"""References by integration: two methods that share nothing, and MuJoCo's accelerations under them.

*Bulirsch–Stoer*: Gragg's midpoint rule, extrapolated.

1. A step of length H is made by the modified midpoint rule with 2, 4, …, 2k substeps; its error has
   only even powers of the substep, so that Neville's scheme removes them one by one (order 2k).
2. The difference of the last two columns is the error estimate; H follows it.
3. The given times are always ends of steps, so that nothing is interpolated.

The state may be of any numbers that numpy adds and multiplies: float64, or `decimal.Decimal` in an
object array for a reference with more digits.

*Of a scene*: `mj_forward` gives the acceleration of a state; the state is then integrated in
positions, plain quaternions, velocities and activations. It shares the engine's model, and nothing
of its integrators. Commands are held: the integration begins anew when one changes.

Sources: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, II.5
and II.9; P. J. Davis, P. Rabinowitz, Methods of Numerical Integration, 2.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjbench.pilot import position_distances
from mjbench.problem import Array, Integrator, Motion, Scenario, Setup
from mjbench.simulation import (
    EngineStates,
    compile_model,
    coordinates,
    initial_data,
    motion_of,
    simulate,
    with_integrator,
)

State = NDArray[Any]
"""(d,) float64, or objects of `Decimal`."""
Rate = Callable[[State], State]
"""dy/dt of an autonomous system."""

_SHRINK, _GROW, _SAFETY = 0.2, 2.5, 0.85


class NoConvergenceError(ArithmeticError):
    """The step became too small: the problem is not smooth there."""


def bulirsch_stoer(
    rate: Rate,
    start: State,
    times: NDArray[np.float64],
    tolerance: float = 1e-14,
    *,
    columns: int = 8,
    first: float = 1e-2,
) -> State:
    """The states (n, d) at the times (n,), which rise; `start` (d,) is the state at time 0.

    `tolerance` bounds the estimated error of a step, relative to 1 + |y| in each component;
    `columns` is half the order; `first` the first step tried, in seconds. A `NoConvergenceError`
    where no step is small enough.
    """
    exact = start.dtype == object
    y, now, trial = start.copy(), Decimal(0) if exact else 0.0, first
    carry = np.zeros_like(y)
    states = []
    for time in times.tolist():
        goal: Any = Decimal(time) if exact else time
        while now < goal:
            left = float(goal - now)
            whole = trial >= left * (1 - 1e-12)
            step: Any = goal - now if whole else (Decimal(trial) if exact else trial)
            change, error = _extrapolate(rate, y, step, columns)
            ratio = error / tolerance
            if not ratio <= 1.0:  # also when it is no number
                factor = _SAFETY * ratio ** (-1 / (2 * columns - 1)) if ratio < 1e300 else _SHRINK
                trial = float(step) * max(_SHRINK, min(factor, 0.9))
                if trial < 1e-12 * first:
                    raise NoConvergenceError(f"no step is small enough at {float(now):.6g} s")
                continue
            change = change - carry  # Kahan's sum: many small steps must not add up roundings
            total = y + change
            y, carry = total, (total - y) - change
            now = goal if whole else now + step
            next_trial = float(step) * min(
                _GROW, _SAFETY * max(ratio, 1e-12) ** (-1 / (2 * columns))
            )
            trial = max(trial, next_trial) if whole else next_trial
        states.append(y.copy())
    return np.array(states)


def _extrapolate(rate: Rate, y: State, step: Any, columns: int) -> tuple[State, float]:
    """The change of y over a step, and its estimated error relative to 1 + |y|."""
    with np.errstate(over="ignore", invalid="ignore"):  # a step too long is made again
        slope = rate(y)
        rows: list[State] = []
        for j in range(1, columns + 1):
            # The change by Gragg's smoothed midpoint rule with 2j substeps.
            h = step / (2 * j)
            before, change = np.zeros_like(y), h * slope
            for _ in range(2 * j - 1):
                before, change = change, before + 2 * h * rate(y + change)
            new = [(before + change + h * rate(y + change)) / 2]
            for k in range(1, j):
                fine, coarse = j * j, (j - k) * (j - k)
                new.append(new[-1] + (new[-1] - rows[k - 1]) * coarse / (fine - coarse))
            rows = new
        size = 1.0 + np.abs(y.astype(float))
        error = np.max(np.abs((rows[-1] - rows[-2]).astype(float)) / size)
    return rows[-1], float(error)


def dop853(rate: Rate, start: Array, times: Array, tolerance: float = 1e-13) -> Array:
    """The states (n, d) at the rising times (n,) s, as by `bulirsch_stoer`."""
    from scipy.integrate import DOP853  # which few commands need

    y, now, step = start, 0.0, math.inf
    states = []
    for time in times.tolist():
        if time > now:
            first = min(step, time - now) if math.isfinite(step) else None
            bounds = {"rtol": tolerance, "atol": tolerance, "first_step": first}
            solver = DOP853(lambda _, y: rate(y), now, y, time, **bounds)
            while solver.status == "running":
                solver.step()
                step = solver.h_abs
            if solver.status == "failed":
                raise NoConvergenceError(f"no step is small enough at {solver.t:.6g} s")
            y, now = solver.y, time
        states.append(y)
    return np.array(states)


_NODES = 20


def cumulative_integral(function: Callable[[Array], Array], times: Array, width: float) -> Array:
    """∫₀ᵗ f for each of the rising times (n,): (n,).

    `function` takes times (k,) and gives (k,); on intervals of `width` it must be so smooth that 20
    nodes suffice.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    edges = np.concatenate([[0.0], times])
    gaps = np.diff(edges)
    parts = max(1, math.ceil(float(np.max(gaps)) / width))
    widths = np.repeat(gaps / parts, parts)
    begins = (edges[:-1, None] + gaps[:, None] * np.arange(parts) / parts).ravel()
    at = begins[:, None] + widths[:, None] * (nodes + 1) / 2
    pieces = function(at.ravel()).reshape(at.shape) @ weights * widths / 2
    total: Array = np.cumsum(pieces.reshape(-1, parts).sum(axis=1))
    return total


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
    """The motion of a smooth scene at the rising times (n,) s."""
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

    A `NoConvergenceError` where the scene is not smooth, or it takes more `evaluations`.
    """
    data = initial_data(scenario, model)
    state = np.concatenate([data.qpos, data.qvel, data.act])
    rate = _rate(model, data, evaluations)
    states = np.empty((len(times), len(state)))
    for begin, end, inputs in scenario.holds(float(times[-1])):
        inputs.give(data)
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


def tends_to(
    model: Any,
    setup: Setup,
    states: EngineStates,
    step: float,
    parting: float,
    near: Array,
) -> bool:
    """Whether the engine comes nearer to these states, the smaller its steps are, from `step` (s).

    Two integrations over the same accelerations agree also where these are not the engine's own,
    as of an activation that only a step clamps. Motions are compared at the difference `parting`,
    where it grows beyond: later they have nothing in common, however small the steps. Smaller
    differences than `near` (n,) count as none: in chaos rounding grows as large.
    """
    near = np.maximum(AGREEMENT, near)
    before = _gaps(model, setup, states, step)
    if np.all(before <= near):
        return True
    for part in _PARTS:
        now = _gaps(model, setup, states, step / part)
        parted = np.flatnonzero(before > parting)
        at = int(parted[0]) if parted.size else int(np.argmax(before))
        if now[at] <= max(NEARER * before[at], near[at]):
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
