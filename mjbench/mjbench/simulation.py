"""Run MuJoCo for measuring: one integrator, one timestep, states sampled on a fixed grid of times.

1. MuJoCo's automatic reset is off, so that a state that blew up stays visible.
2. Energy and momentum belong to the sampled state: `mjData.energy` after `mj_step` is that of the
   state before the step, so it is computed again, on other data.
3. MuJoCo writes a warning to standard error and into a file in the working directory; here it is
   counted, and becomes part of the judgement.
"""

from __future__ import annotations

import copy
import math
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.detector import (
    Passages,
    Peaks,
    RunJudgement,
    deepest_contact,
    judge,
    update_peaks,
)
from mjbench.loop import close_loop, step
from mjbench.problem import Array, Integrator, Motion, Scenario, Setup

_CODE = {
    Integrator.EULER: mujoco.mjtIntegrator.mjINT_EULER,
    Integrator.EULER_EXPLICIT: mujoco.mjtIntegrator.mjINT_EULER,
    Integrator.IMPLICIT: mujoco.mjtIntegrator.mjINT_IMPLICIT,
    Integrator.IMPLICITFAST: mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    Integrator.RK4: mujoco.mjtIntegrator.mjINT_RK4,
    Integrator.DISCRETE: mujoco.mjtIntegrator.mjINT_DISCRETE,
}
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""All that the next step depends on."""
_LOOK_INTERVAL = 8
"""Steps from one look at the state to the next: what shoots up takes longer to come back."""


@lru_cache(maxsize=64)
def _original(mjcf: str) -> Any:
    return mujoco.MjModel.from_xml_string(mjcf)


def compile_model(mjcf: str, integrator: Integrator, timestep: float) -> Any:
    """A `mjModel` of its own with this integrator and timestep (s), and automatic reset off."""
    return with_integrator(_original(mjcf), integrator, timestep)


def with_integrator(model: Any, integrator: Integrator, timestep: float) -> Any:
    """A copy of a `mjModel` with this integrator and timestep (s), and automatic reset off."""
    model = copy.copy(model)
    set_integrator(model, integrator, timestep)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


_SOLREFS = (
    *("geom_solref", "flex_solref", "pair_solref", "pair_solreffriction", "eq_solref"),
    *("jnt_solref", "dof_solref", "tendon_solref_lim", "tendon_solref_fri"),
)


def stiffened(model: Any, times: float) -> Any:
    """A copy of a `mjModel` whose contacts, limits, friction and equalities are stiffer.

    Their time constants are so many times shorter; under friction slips as much less.
    """
    model = copy.copy(model)
    tables = [getattr(model, name) for name in _SOLREFS]
    for table in (*tables, model.opt.o_solref[None]):
        is_time = table[:, 0] > 0
        table[is_time, 0] /= times
        table[~is_time] *= times**2, times
    model.opt.impratio *= times**2
    return model


def without_sleep(model: Any) -> Any:
    """A copy of a `mjModel` in which nothing falls asleep.

    MuJoCo counts slow steps, not time: in small enough steps whatever begins from rest would sleep.
    """
    model = copy.copy(model)
    model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    return model


def with_converged_solver(model: Any) -> Any:
    """A copy of a `mjModel` whose solver goes to its end.

    With no tolerance at all `discrete` would divide nothing by nothing at a rest.
    """
    model = copy.copy(model)
    model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    model.opt.iterations, model.opt.tolerance = max(100, int(model.opt.iterations)), 1e-30
    return model


def set_integrator(model: Any, integrator: Integrator, timestep: float) -> None:
    """Give a model this integrator and timestep (s)."""
    model.opt.integrator = int(_CODE[integrator])
    model.opt.timestep = timestep
    if integrator is Integrator.EULER_EXPLICIT:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


def integrator_of(model: Any) -> Integrator:
    """The integrator that a model has."""
    return next(
        integrator for integrator, code in _CODE.items() if int(code) == int(model.opt.integrator)
    )


class silent:  # noqa: N801 - used as a function, and quicker than a generator
    """A context in which MuJoCo prints no warnings."""

    __slots__ = ("before",)

    def __enter__(self) -> None:
        self.before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda _: None)

    def __exit__(self, *_: object) -> None:
        mujoco.set_mju_user_warning(self.before)


def advance(model: Any, data: Any, steps: int = 1) -> None:
    """Make so many steps; MuJoCo's warnings are counted in `data.warning`, and not printed."""
    with silent():
        step(model, data, steps)


def watch_steps(
    model: Any, data: Any, steps: int, passages: Passages, iterations: list[int] | None = None
) -> None:
    """Make so many steps, and watch what goes through what.

    `iterations` gets those of the solver, of the last evaluation of each step.
    """
    if not passages.needed and iterations is None:
        advance(model, data, steps)
        return
    with silent():
        for _ in range(steps):
            step(model, data, 1)
            passages.look(data)
            if iterations is not None:
                iterations.append(int(data.solver_niter.sum()))


def initial_data(scenario: Scenario, model: Any) -> Any:
    """`mjData` in the initial state of a scenario."""
    data = mujoco.MjData(model)
    if scenario.keyframe >= 0:
        mujoco.mj_resetDataKeyframe(model, data, scenario.keyframe)
        data.time = 0.0
    if scenario.qpos:
        data.qpos[:] = scenario.qpos
    if scenario.qvel:
        data.qvel[:] = scenario.qvel
    if scenario.act:
        data.act[:] = scenario.act
    scenario.holds()[0][2].give(data)
    if scenario.loop is not None:
        close_loop(scenario.loop, model, data)
    return data


def nudged(scenario: Scenario, model: Any, change: Array) -> Scenario:
    """A scenario that begins aside by changes of positions and velocities, (2, nv)."""
    data = initial_data(scenario, model)
    mujoco.mj_integratePos(model, data.qpos, change[0], 1.0)
    return replace(scenario, qpos=tuple(data.qpos), qvel=tuple(data.qvel + change[1]))


def runnable(model: Any) -> Any:
    """A copy of a `mjModel` under its own setting, with automatic reset off."""
    return with_integrator(model, integrator_of(model), float(model.opt.timestep))


def full_state(model: Any, data: Any) -> Array:
    """The present state, as `STATE` selects it."""
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


class EngineStates(Struct, frozen=True):
    """A motion in the engine's coordinates, at n times."""

    times: Array
    """(n,) s."""
    qpos: Array
    """(n, nq)."""
    qvel: Array
    """(n, nv)."""
    act: Array
    """(n, na): activations of actuators."""

    def head(self, count: int) -> EngineStates:
        """The first `count` of the states."""
        parts = (self.times, self.qpos, self.qvel, self.act)
        return EngineStates(*(part[:count] for part in parts))


def coordinates(model: Any) -> tuple[list[int], list[int]]:
    """The indices in `qpos` of positions, and of the beginnings of quaternions."""
    places: list[int] = []
    turns: list[int] = []
    for kind, start in zip(model.jnt_type, model.jnt_qposadr, strict=True):
        at = int(start)
        match mujoco.mjtJoint(int(kind)):
            case mujoco.mjtJoint.mjJNT_FREE:
                places += [at, at + 1, at + 2]
                turns.append(at + 3)
            case mujoco.mjtJoint.mjJNT_BALL:
                turns.append(at)
            case _:
                places.append(at)
    return places, turns


def motion_of(model: Any, states: EngineStates) -> Motion:
    """States sorted into positions, attitudes and velocities."""
    places, turns = coordinates(model)
    attitude = np.empty((len(states.times), len(turns), 4))
    for index, at in enumerate(turns):
        attitude[:, index] = states.qpos[:, at : at + 4]
    return Motion(states.times, states.qpos[:, places], attitude, states.qvel)


class Run(Struct, frozen=True):
    """A simulation, sampled n times."""

    states: EngineStates
    energy: Array
    """(n + 1, 2) J: potential and kinetic, first those of the beginning."""
    momentum: Array
    """(n + 1, 3) kg m²/s: angular, of everything about its centre of mass, in the world's frame."""
    penetration: float
    """Deepest contact at those times, m."""
    sunk: float
    """The same as `Peaks.sunk`."""
    passing: frozenset[tuple[int, int]]
    """Pairs of geoms that went through each other, or are inside each other at the end."""
    judgement: RunJudgement


def simulate(setup: Setup, model: Any, iterations: list[int] | None = None) -> Run:
    """Run a scenario with a model under its own options; `iterations` as for `watch_steps`."""
    scenario, times = setup.scenario, setup.scenario.times
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    steps = scenario.steps(float(model.opt.timestep))
    data, scratch = initial_data(scenario, model), initial_data(scenario, model)
    qpos, qvel, act = (np.full((len(times), n), np.nan) for n in (model.nq, model.nv, model.na))
    table = np.full((len(times) + 1, 5), np.nan)
    table[0] = invariants(model, scratch, data.qpos, data.qvel)
    peaks, passages = Peaks(penetration=deepest_contact(scratch)), Passages(model, setup)
    for index, inputs in enumerate(scenario.inputs(scenario.sample)):
        inputs.give(data)
        for done in range(0, steps, _LOOK_INTERVAL):
            if peaks.finite:
                watch_steps(model, data, min(_LOOK_INTERVAL, steps - done), passages, iterations)
                peaks = update_peaks(data, peaks, passages.thickness)
        if not peaks.finite:
            break
        qpos[index], qvel[index], act[index] = data.qpos, data.qvel, data.act
        table[index + 1] = invariants(model, scratch, data.qpos, data.qvel)
        # Where a step ends, its contacts are still those of its beginning.
        peaks = replace(peaks, penetration=max(peaks.penetration, deepest_contact(scratch)))
    judgement = judge(data, peaks, setup, passages.texts())
    states = EngineStates(times, qpos, qvel, act)
    return Run(
        states,
        table[:, :2],
        table[:, 2:],
        peaks.penetration,
        peaks.sunk,
        passages.pairs(),
        judgement,
    )


_FINER = 8
"""How many times shorter the steps are that tell a soft contact from a lost run."""


def expect_passages(setup: Setup, model: Any) -> Setup:
    """The setup that expects what goes through what, or stays in it, in small steps too."""
    step = float(model.opt.timestep) / _FINER
    fine = without_sleep(with_integrator(model, integrator_of(model), step))
    return replace(setup, passing=simulate(setup, fine).passing)


def run_steps(
    mjcf: str, scenario: Scenario, integrator: Integrator, timestep: float, steps: int
) -> Any:
    """`mjData` after so many steps from where a scenario begins."""
    model = compile_model(mjcf, integrator, timestep)
    data = initial_data(scenario, model)
    advance(model, data, steps)
    return data


def invariants(model: Any, scratch: Any, qpos: Array, qvel: Array) -> Array:
    """Potential and kinetic energy (J) and angular momentum (kg m²/s) of a state: (5,).

    `scratch` is `mjData` that nothing else uses.
    """
    scratch.qpos[:], scratch.qvel[:] = qpos, qvel
    mujoco.mj_fwdPosition(model, scratch)
    mujoco.mj_fwdVelocity(model, scratch)
    mujoco.mj_energyPos(model, scratch)
    mujoco.mj_energyVel(model, scratch)
    mujoco.mj_subtreeVel(model, scratch)
    return np.concatenate([scratch.energy, scratch.subtree_angmom[0]])


def refsafe_active(model: Any, *, contact: bool = True) -> bool:
    """Whether MuJoCo may soften a constraint because the timestep is long: see `refsafe_from`."""
    return float(model.opt.timestep) * (1 - 1e-12) > refsafe_from(model, contact=contact)


def refsafe_from(model: Any, *, contact: bool = True) -> float:
    """The timestep beyond which MuJoCo may soften a constraint, s; infinite where there is none.

    Unless `refsafe` is off it raises time constants to two timesteps: that is stable, and another
    model. It concerns geoms that can touch, equalities, limits and dry friction.

    `contact`: whether anything touches in the motion that is asked about.
    """
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_REFSAFE):
        return math.inf
    flags = int(model.opt.disableflags)
    can_touch = (model.geom_contype | model.geom_conaffinity) != 0
    contact = contact and not flags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    can_touch &= contact and model.ngeom > 1
    constants = np.concatenate(
        [
            model.geom_solref[can_touch, 0],
            model.pair_solref[:, 0] if contact else [],
            model.eq_solref[:, 0],
            model.jnt_solref[model.jnt_limited != 0, 0],
            model.dof_solref[model.dof_frictionloss > 0, 0],
            model.tendon_solref_lim[model.tendon_limited != 0, 0],
            model.tendon_solref_fri[model.tendon_frictionloss > 0, 0],
        ]
    )
    # A constant that is not positive is a stiffness, which is taken as it is.
    return float(np.min(constants[constants > 0], initial=math.inf)) / 2
