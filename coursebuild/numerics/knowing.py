"""What a scene's motion is measured against, and how well that is known.

Entry point: `know(model, scene, pilot, quick)`.

1. A smooth scene is integrated over `mj_forward` by Bulirsch–Stoer; Gauss's collocation does it
   again. Their difference is what the reference may be wrong by. Both take the same accelerations,
   so the engine in ever smaller steps must tend to the same motion.
2. A closed form that the scenario names comes first, and that integration second. Where the two
   are far apart the formula is not this scene's.
3. Where something jumps, or the engine tends elsewhere, only the engine itself is left, in small
   steps, and again in steps twice as long under another integrator; it is called `self`. So it is
   where the scene is too stiff for an integration in reasonable time.
4. A motion counts only as long as it is known: where two integrations part, the horizon ends.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.model.scenarios import DeclaredScenario
from coursebuild.numerics.collocation import collocated
from coursebuild.numerics.engine import motion_of, simulate_model, varied
from coursebuild.numerics.extrapolation import NoConvergenceError, Rate, State, integrate
from coursebuild.numerics.forward import Method, States, forward_states, quaternions
from coursebuild.numerics.measure import errors
from coursebuild.numerics.pilot import Bounded, Pilot, apart
from coursebuild.numerics.problem import Array, Integrator, Motion, Problem
from coursebuild.numerics.rotation import conjugate, multiply
from coursebuild.numerics.scene import Scene, SceneError
from coursebuild.numerics.tending import tends_to

EVALUATIONS, QUICK_EVALUATIONS = 2_000_000, 400_000
"""Accelerations that a reference may take."""
FINER, QUICK_FINER = 16, 8
"""Times by which steps of a `self` reference are shorter than the shortest that is measured."""
PARTED = 0.01
"""Where two runs of the engine part, so that neither is a reference: rad, or relative to the
extent."""
FOREIGN = 1e-3
"""The difference from which on a closed form is that of another scene, in the same units."""
_STEP = 1e-6
"""s, of the model whose accelerations are integrated: `refsafe` softens nothing then."""


class Floor(Struct, frozen=True):
    """What a reference may be wrong by."""

    position: float
    """m or rad."""
    attitude: float
    """rad."""
    velocity: float
    """m/s or rad/s."""

    @property
    def place(self) -> float:
        """Of positions and attitudes together."""
        return max(self.position, self.attitude)


class Known(Struct, frozen=True):
    """The reference of a scene, from the first sample to the horizon."""

    kind: str
    """`closed`, `ode` or `self`."""
    source: str
    states: States
    other: States
    """Those of the second reference."""
    motion: Motion
    floor: Floor
    second: str
    """The source of the second reference."""
    agreement: float
    """The largest difference of the two, in m, rad, m/s and rad/s."""
    horizon: float
    """s."""
    note: str = ""
    """Why it is no better one; empty where it is the best there is."""

    def until(self, count: int) -> Known:
        """Only the first samples."""
        times = self.motion.times[:count]
        motion = Motion(
            times,
            self.motion.position[:count],
            self.motion.attitude[:count],
            self.motion.velocity[:count],
        )
        return replace(self, states=_head(self.states, count), motion=motion)


def know(model: Any, scene: Scene, first: Pilot, *, quick: bool = False) -> Known:
    """The reference of a scene.

    Raises:
        SceneError: the scenario names a closed form that is not this scene's.
    """
    wanted = scene.declared
    found, note = None, ""
    if first.smooth and not (wanted and wanted.reference == "self"):
        try:
            found = _integrated(model, first, quick)
        except NoConvergenceError as error:
            note = f"no integration: {error}"
        if found is not None and not _tended(model, scene, first, found):
            found, note = None, f"no integration: {_ELSEWHERE}"
            if wanted and wanted.reference == "ode":
                raise _no_integration(_ELSEWHERE, wanted)
    elif wanted and wanted.reference == "ode":
        raise _no_integration(f"there is {' and '.join(first.jumps)}", wanted)
    if found is None:
        found = replace(itself(model, scene, first, quick=quick), note=note)
    return _closed(model, scene, found) if wanted and wanted.closed else found


def _no_integration(why: str, declared: DeclaredScenario) -> SceneError:
    message = f"no integration can be the reference: {why}"
    help = "leave `reference` out: the engine itself in small steps is the reference then"
    return SceneError(message, declared.place("reference"), help)


# ---------------------------------------------------------------------------------- integrations


def _integrated(model: Any, first: Pilot, quick: bool) -> Known:
    """By two methods over the engine's accelerations."""
    times = _until(first.setup.scenario.times, first.horizon)
    exact = varied(model, Integrator.EULER, _STEP)
    exact.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    exact.opt.iterations, exact.opt.tolerance = max(100, int(exact.opt.iterations)), 0.0
    exact.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
    exact.actuator_actearly[:] = 0  # it looks ahead by a timestep, which tends to nothing
    most = QUICK_EVALUATIONS if quick else EVALUATIONS

    def run(method: Method) -> States:
        return forward_states(exact, first.setup, times, method, evaluations=most)

    states = run(_bulirsch_stoer)
    source = "Bulirsch–Stoer over mj_forward"
    try:
        other, second = run(collocated), "Gauss's collocation of order 12 over mj_forward"
    except NoConvergenceError:
        other, second = run(_lower), "Bulirsch–Stoer of order 12 over mj_forward"
    return _compared(model, "ode", source, states, second, other, first.horizon)


def _tended(model: Any, scene: Scene, first: Pilot, found: Known) -> bool:
    setup = _cut(first.setup, float(found.states.times[-1]))
    return tends_to(model, setup, found.states, min(scene.timesteps), PARTED)


_ELSEWHERE = "the engine in small steps tends elsewhere"


def _bulirsch_stoer(rate: Rate, start: State, times: Array) -> State:
    return integrate(rate, start, times, 1e-13)


def _lower(rate: Rate, start: State, times: Array) -> State:
    return integrate(rate, start, times, 1e-12, columns=6, first=3e-3)


def itself(model: Any, scene: Scene, first: Pilot, *, quick: bool = False) -> Known:
    """By the engine itself in small steps, and in steps twice as long under another integrator."""
    step = min(scene.timesteps) / (QUICK_FINER if quick else FINER)
    found = []
    for integrator, length in ((Integrator.IMPLICITFAST, step), (Integrator.EULER, 2 * step)):
        fine = varied(model, integrator, length)
        fine.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
        fine.opt.iterations = max(100, int(fine.opt.iterations))
        fine.opt.tolerance = min(1e-10, float(fine.opt.tolerance))
        run = simulate_model(_cut(first.setup, first.horizon), fine)
        if not np.isfinite(run.qpos).all():
            raise SceneError(f"it diverges even at {step:g} s a step")
        found.append(States(run.times, run.qpos, run.qvel, run.act))
    gaps = [apart(model, a, b) for a, b in zip(found[0].qpos, found[1].qpos, strict=True)]
    good = next((i for i, gap in enumerate(gaps) if gap > PARTED), len(gaps))
    count = max(1, good)
    states, other = _head(found[0], count), _head(found[1], count)
    source = f"the engine itself: implicitfast at {step:g} s, Newton's solver"
    second = f"the same under Euler at {2 * step:g} s"
    horizon = float(states.times[-1])
    return _compared(model, "self", source, states, second, other, horizon)


def _compared(
    model: Any, kind: str, source: str, states: States, second: str, other: States, horizon: float
) -> Known:
    motion = _motion(model, states)
    floor = difference(motion, _motion(model, other))
    agreement = max(floor.position, floor.attitude, floor.velocity)
    return Known(kind, source, states, other, motion, _raised(floor), second, agreement, horizon)


_ROUNDING = 1e-14
"""No reference in double precision is known better, in rad and relative to sizes of 1."""


def _raised(floor: Floor) -> Floor:
    return Floor(*(max(_ROUNDING, one) for one in (floor.position, floor.attitude, floor.velocity)))


def difference(first: Motion, second: Motion) -> Floor:
    """The largest differences of two motions."""
    found = errors(first, second)
    parts = (found.position, found.attitude, found.velocity)
    return Floor(*(0.0 if one is None else one.largest for one in parts))


# ----------------------------------------------------------------------------------- closed forms


def _closed(model: Any, scene: Scene, second: Known) -> Known:
    """The closed form that the scenario names, with what was integrated as the second reference."""
    from coursebuild.numerics.problems import problem_named

    declared = scene.declared
    assert declared is not None
    problem = problem_named(declared.closed)
    place = declared.place("reference")
    motion = _moved(model, scene, problem, second.states, declared.closed)
    assert problem.reference is not None
    floor = difference(motion, second.motion)
    states = _states_of(model, motion, second.states)
    gap = max(
        (apart(model, a, b) for a, b in zip(states.qpos, second.states.qpos, strict=True)),
        default=0.0,
    )
    if second.kind == "ode" and gap > FOREIGN:
        message = f"the closed form of `{declared.closed}` is not this scene's motion"
        help = f"the two are {gap:.2g} apart (rad, or relative to the extent)"
        raise SceneError(message, place, help)
    known = problem.reference.floor
    own = Floor(known, known, known)
    agreement = max(floor.position, floor.attitude, floor.velocity)
    if second.kind == "ode":
        own = Floor(
            max(known, floor.position), max(known, floor.attitude), max(known, floor.velocity)
        )
    return Known(
        "closed",
        problem.reference.source,
        states,
        second.states,
        motion,
        own,
        second.source,
        agreement,
        second.horizon,
    )


def _moved(model: Any, scene: Scene, problem: Problem, like: States, name: str) -> Motion:
    """The closed form's motion, begun where the scene begins.

    Raises:
        SceneError: the scene begins otherwise than the hard case, but for the place of free bodies.
    """
    from coursebuild.numerics.engine import begun, compiled

    declared = scene.declared
    assert declared is not None and problem.reference is not None
    place = declared.place("reference")
    there = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    if (there.jnt_type.tolist(), there.nq) != (model.jnt_type.tolist(), model.nq):
        message = f"the model has other joints than the hard case `{name}`"
        raise SceneError(message, place)
    here_data = begun(Bounded(scene.scenario, 1.0, 1.0), model)
    there_data = begun(problem, there)
    zero = np.zeros(1)
    here = motion_of(model, zero, here_data.qpos[None], here_data.qvel[None])
    start = motion_of(there, zero, there_data.qpos[None], there_data.qvel[None])
    shift = here.position - start.position
    free = np.concatenate(
        [
            np.full(3 if kind == mujoco.mjtJoint.mjJNT_FREE else 1, kind == 0)
            for kind in model.jnt_type
            if kind != mujoco.mjtJoint.mjJNT_BALL
        ]
        or [np.zeros(0, dtype=bool)]
    )
    speeds = np.abs(here.velocity - start.velocity).max(initial=0.0)
    if np.abs(shift[:, ~free]).max(initial=0.0) > 1e-9 or speeds > 1e-9:
        message = f"the scenario begins otherwise than the hard case `{name}`"
        raise SceneError(message, place, "its closed form holds for its own beginning only")
    turn = multiply(here.attitude, conjugate(start.attitude))
    motion = problem.reference.motion(like.times)
    return Motion(
        motion.times, motion.position + shift, multiply(turn, motion.attitude), motion.velocity
    )


def _states_of(model: Any, motion: Motion, like: States) -> States:
    """A motion in the engine's coordinates; activations as in a like motion."""
    qpos = like.qpos.copy()
    turns = quaternions(model)
    inside = {at + k for at in turns for k in range(4)}
    qpos[:, [i for i in range(int(model.nq)) if i not in inside]] = motion.position
    for index, at in enumerate(turns):
        qpos[:, at : at + 4] = motion.attitude[:, index]
    return States(motion.times, qpos, motion.velocity, like.act)


# ----------------------------------------------------------------------------------------- pieces


def _motion(model: Any, states: States) -> Motion:
    return motion_of(model, states.times, states.qpos, states.qvel)


def _until(times: Array, horizon: float) -> Array:
    kept: Array = times[times <= horizon * (1 + 1e-9)]
    return kept


def _head(states: States, count: int) -> States:
    return States(
        states.times[:count], states.qpos[:count], states.qvel[:count], states.act[:count]
    )


def _cut(setup: Bounded, horizon: float) -> Bounded:
    """The same until the horizon, a multiple of the sample."""
    return replace(setup, scenario=replace(setup.scenario, duration=horizon))
