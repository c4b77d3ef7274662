"""Theory of stability: the one-step map, linearized at rest.

1. A step maps a state (`qpos`, `qvel`, `act`) to the next one. Its derivative is taken by central
   differences of fourth order, in the tangent space, so that quaternions and activations need no
   care of their own, and every integrator is treated alike.
2. At rest, the largest timestep up to which its spectral radius is at most one is the limit of
   linear theory. A rest that is unstable by itself (an inverted pendulum) says nothing of a
   timestep, nor does one to which nothing pulls back, or about which forces have another law on
   either side (a muscle at no activation); there is no theory then.

Source: J. Guckenheimer, P. Holmes, Nonlinear Oscillations, Dynamical Systems, and Bifurcations of
Vector Fields, 1.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from mjbench.pilot import scales
from mjbench.problem import Array, Integrator, Limit, Scenario
from mjbench.simulation import (
    advance,
    initial_data,
    with_converged_solver,
    with_integrator,
    without_sleep,
)

_STEP, _NEAR_STEP = 1e-4, 1e-7
"""Steps of differences, relative to a model's extent or to 1 rad; where something touches, shorter
than contacts are deep."""
_UNIT, _NEAR_UNIT = 1e-6, 1e-4
"""By how much a spectral radius may exceed 1 by rounding: a double eigenvalue 1 splits by the root
of the rounding."""
_SHORTER, _LONGER = 10.0, 100.0
"""How much farther than runs theory looks for a limit: to timesteps of several whole scenarios."""
AT_REST = "spectral radius of the step, linearized at rest"
"""The source of the theory of a scene."""
MOST_STATES = 120
"""Numbers in a state up to which there is theory."""
_RELAXING, _POLISHING, _GRID = 20_000, 30, 24
"""Steps and iterations to look for a rest, and timesteps tried in a decade."""
_WAYS, _KINK = 8, 0.02
"""Directions from a rest in which forces are compared with their derivative, and the difference,
relative to the largest of them, from which on there is none."""
_STILL = 1e-9
"""The part of the strongest acceleration below which Newton's method goes on."""
_DRIFT = 1e-3
"""The acceleration, relative to gravity's, beyond which a state is no rest of a step."""


class FixedState(Struct, frozen=True, eq=False):
    """A state that theory linearizes about."""

    qpos: Array
    qvel: Array
    act: Array
    ctrl: Array
    touches: bool = False
    """Whether contacts, limits or dry friction act in it."""

    @property
    def step(self) -> float:
        """The step of differences about it."""
        return _NEAR_STEP if self.touches else _STEP


def _converged(model: Any, integrator: Integrator, timestep: float) -> Any:
    """A copy of a model that is awake and whose solver goes to its end: differences are smooth."""
    return with_converged_solver(without_sleep(with_integrator(model, integrator, timestep)))


def _state_of(data: Any) -> FixedState:
    qpos, qvel, act, ctrl = (part.copy() for part in (data.qpos, data.qvel, data.act, data.ctrl))
    return FixedState(qpos, qvel, act, ctrl, bool(data.nefc > data.ne))


def _set(model: Any, data: Any, state: FixedState, change: Array) -> None:
    """Put a state moved by a change in the tangent space (2 nv + na,) into `data`."""
    nv = int(model.nv)
    data.qpos[:], data.act[:] = state.qpos, state.act + change[2 * nv :]
    mujoco.mj_integratePos(model, data.qpos, change[:nv], 1.0)
    data.qvel[:], data.ctrl[:] = state.qvel + change[nv : 2 * nv], state.ctrl
    data.qacc_warmstart[:] = 0.0


def _difference(model: Any, first: Any, second: Any) -> Array:
    """The way from one state to another in the tangent space."""
    change = np.empty(int(model.nv))
    mujoco.mj_differentiatePos(model, change, 1.0, first.qpos, second.qpos)
    return np.concatenate([change, second.qvel - first.qvel, second.act - first.act])


def _derivative(function: Callable[[Array], Array], units: Array, step: float) -> Array:
    """The derivative of a function of the tangent space at 0, by differences of fourth order."""
    columns = []
    for index, unit in enumerate(units):
        change = np.zeros(len(units))
        values = []
        for part in (1.0, -1.0, 2.0, -2.0):
            change[index] = part * step * unit
            values.append(function(change))
        near, far = values[0] - values[1], values[2] - values[3]
        columns.append((8 * near - far) / (12 * step * unit))
    return np.array(columns).T


def _units(model: Any) -> Array:
    lengths = scales(model)
    return np.concatenate([lengths, lengths, np.ones(int(model.na))])


def _step_derivative(model: Any, data: Any, state: FixedState) -> Array:
    """The derivative of a step of a model at a state."""

    def after(change: Array) -> Array:
        _set(model, data, state, change)
        advance(model, data)
        return _difference(model, following, data)

    units = _units(model)
    _set(model, data, state, np.zeros(len(units)))
    advance(model, data)
    following = _state_of(data)
    return _derivative(after, units, state.step)


def find_rest(model: Any, scenario: Scenario) -> FixedState | None:
    """The rest that a scenario leads to under its last command, if it is stable by itself.

    A run is stopped wherever its kinetic energy is largest, until it lies still; Newton's method
    does the rest.
    """
    # A step has to be a function of the state alone, which differences can show.
    has_memory = model.nplugin or np.any(model.actuator_history[:, 0] > 0)
    if has_memory or 2 * model.nv + model.na > MOST_STATES:
        return None
    variant = _converged(model, Integrator.IMPLICITFAST, float(model.opt.timestep) / 2)
    variant.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, before, strongest = initial_data(scenario, variant), 0.0, 0.0
    scenario.holds()[-1][2].give(data)
    data.qvel[:] = 0.0
    for _ in range(_RELAXING):
        advance(variant, data)
        kinetic = float(data.energy[1])
        if kinetic < before:
            data.qvel[:], kinetic = 0.0, 0.0
        before = kinetic
        force = float(np.abs(np.concatenate([data.qacc, data.act_dot])).max(initial=0.0))
        if not math.isfinite(force):
            return None
        strongest = max(strongest, force)
        if force < _STILL * strongest:
            break
    rest = _polished(variant, data)
    if rest is None:
        return None
    force = np.abs(_accelerations(variant, data, rest)).max(initial=0.0)
    if force > 1e-6 * max(1.0, float(np.abs(model.opt.gravity).max())):
        return None
    nv, na = int(model.nv), int(model.na)
    inner = _force_derivative(variant, data, rest)
    if _is_kinked(variant, data, rest, inner):
        return None
    flow = np.zeros((2 * nv + na, 2 * nv + na))
    flow[:nv, nv : 2 * nv], flow[nv:] = np.eye(nv), inner
    rates = np.linalg.eigvals(flow)
    largest = float(np.abs(rates).max(initial=0.0))
    if largest < 1e-6 or rates.real.max() > 1e-4 * largest:
        return None
    return rest


def _accelerations(model: Any, data: Any, state: FixedState, change: Array | None = None) -> Array:
    """`qacc` and `act_dot` of a moved state."""
    _set(model, data, state, np.zeros(2 * model.nv + model.na) if change is None else change)
    mujoco.mj_forward(model, data)
    return np.concatenate([data.qacc, data.act_dot])


def _force_derivative(model: Any, data: Any, state: FixedState) -> Array:
    return _derivative(lambda x: _accelerations(model, data, state, x), _units(model), state.step)


def _is_kinked(model: Any, data: Any, state: FixedState, derivative: Array) -> bool:
    """Whether forces differ from their derivative by a part of it, in some direction."""
    middle = _accelerations(model, data, state)
    for way in np.random.default_rng(4).normal(size=(_WAYS, len(_units(model)))):
        change = state.step * way * _units(model)
        expected = derivative @ change
        for side in (1.0, -1.0):
            gap = _accelerations(model, data, state, side * change) - middle - side * expected
            if np.abs(gap).max(initial=0.0) > _KINK * np.abs(expected).max(initial=0.0):
                return True
    return False


def _polished(model: Any, data: Any) -> FixedState | None:
    """The rest next to a state, by Newton's method over positions and activations."""
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    state, nv = _state_of(data), int(model.nv)
    free = np.r_[:nv, 2 * nv : 2 * nv + model.na]
    for _ in range(_POLISHING):
        slope = _accelerations(model, data, state)
        matrix = _force_derivative(model, data, state)[:, free]
        if not np.isfinite(matrix).all():
            return None
        change = np.zeros(2 * nv + model.na)
        change[free] = np.linalg.lstsq(matrix, -slope, rcond=1e-9)[0]
        change /= max(1.0, 2 * float(np.abs(change[:nv]).max(initial=0.0)))
        _set(model, data, state, change)
        mujoco.mj_forward(model, data)
        state = _state_of(data)
    return state


def step_excess(model: Any, rest: FixedState, integrator: Integrator, timestep: float) -> float:
    """How far a step of two states is beyond stability at rest; below 0 where it is stable.

    Of the coefficients of the characteristic polynomial, which unlike its roots are smooth where
    two of these meet.
    """
    variant = _converged(model, integrator, timestep)
    matrix = _step_derivative(variant, mujoco.MjData(variant), rest)
    trace, determinant = float(np.trace(matrix)), float(np.linalg.det(matrix))
    return max(determinant - 1, abs(trace) - 1 - determinant)


def rest_limit(
    model: Any, rest: FixedState, integrator: Integrator, search: tuple[float, float]
) -> float | None:
    """The first timestep at which a rest is not stable, s; infinite where there is none.

    `None` where a shorter one has another rest, as those have that make contacts softer.
    `search`: the timesteps (s) between which it is looked for.
    """
    unit = 1 + (_NEAR_UNIT if rest.touches else _UNIT)
    low, high = search
    variant = _converged(model, integrator, low)
    data = mujoco.MjData(variant)

    def is_rest(timestep: float) -> bool:
        variant.opt.timestep = timestep
        _set(variant, data, rest, np.zeros(2 * model.nv + model.na))
        advance(variant, data)
        return bool(np.abs(data.qvel).max(initial=0.0) < _DRIFT * strongest * timestep)

    def is_lost(timestep: float) -> bool:
        variant.opt.timestep = timestep
        matrix = _step_derivative(variant, data, rest)
        if not np.isfinite(matrix).all():
            return True
        return not float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0)) <= unit

    count = max(2, round(_GRID * math.log10(high / low)) + 1)
    before, strongest = 0.0, max(1.0, float(np.abs(model.opt.gravity).max()))
    for step in np.geomspace(low, high, count).tolist():
        if rest.touches and not is_rest(step):
            return None
        if is_lost(step):
            break
        before = step
    else:
        return math.inf
    while before and step / before > 1 + 1e-7:
        middle = math.sqrt(before * step)
        before, step = (before, middle) if is_lost(middle) else (middle, step)
    return before


class Theory(Struct, frozen=True, eq=False):
    """What theory says of a scene's largest stable timesteps."""

    formula: Callable[[Integrator], Limit | None] | None = None
    """Of a hard case; it comes before linearization."""
    model: Any = None
    rest: FixedState | None = None

    def limit(self, integrator: Integrator, search: tuple[float, float]) -> Limit | None:
        """The largest stable timestep at rest; `None` where there is no such theory."""
        limit = self.formula(integrator) if self.formula is not None else None
        if limit is None and self.rest is not None:
            wide = search[0] / _SHORTER, search[1] * _LONGER
            try:
                timestep = rest_limit(self.model, self.rest, integrator, wide)
            except mujoco.FatalError:  # the integrator does not run the model
                timestep = None
            limit = None if timestep is None else Limit(timestep, AT_REST)
        return limit


def find_theory(
    model: Any,
    scenario: Scenario,
    formula: Callable[[Integrator], Limit | None] | None = None,
    visits: Callable[[Array], bool] = lambda _: True,
) -> Theory:
    """What theory says of a scene at its rest.

    `visits`: whether the motion comes near to positions; of a rest that it never sees theory would
    answer another question.
    """
    rest = find_rest(model, scenario)
    rest = None if rest is None or not visits(rest.qpos) else rest
    return Theory(formula, model, rest)
