"""What a scene's motion is measured against, and how well that is known.

Entry points: `find_reference(model, first)`, the reference of a scene; `references(model, first)`,
by cone where something touches; `find_conserved(…)`, `energy_beyond(…)`.

1. A smooth scene is integrated over `mj_forward` by Bulirsch–Stoer; DOP853 does it
   again. Their difference is what the reference may be wrong by. Both take the same accelerations,
   so the engine in ever smaller steps must tend to the same motion.
2. A closed form that the scenario names, or that the course has, comes first, and that integration
   second. Where the two are far apart the formula is not this scene's.
3. Where something jumps, or the engine tends elsewhere, only the engine itself is left, in small
   steps, and again in steps twice as long under another integrator; it is called `self`. So it is
   where the scene is too stiff for an integration in reasonable time.
4. A motion counts only as long as it is known: where two integrations part, the horizon ends.
5. Errors under a cone are those of the timestep and the solver: they are measured against what the
   engine tends to under that cone in small steps. What remains then is the model's own error:
   against the closed form where the scenario names one, else of a pyramid against the cone that it
   stands for.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.scenarios import DeclaredScenario
from coursebuild.core.text.source import Span
from coursebuild.numerics.cases import closed_motion, floor
from coursebuild.numerics.detector import RunJudgement, RunStatus
from coursebuild.numerics.engine import (
    EngineStates,
    Run,
    initial_data,
    invariants,
    motion_of,
    simulate,
    states_of,
    with_integrator,
)
from coursebuild.numerics.forward import Method, forward_states, tends_to
from coursebuild.numerics.integrate import NoConvergenceError, bulirsch_stoer, dop853
from coursebuild.numerics.measure import (
    energy_drift,
    energy_scale,
    errors,
    largest_errors,
    momentum_drift,
)
from coursebuild.numerics.observe import Sticks, sticking, visible_error
from coursebuild.numerics.pilot import Pilot, position_distances
from coursebuild.numerics.problem import ROUNDING, Integrator, Motion, Setup, Sizes
from coursebuild.numerics.reports.bench import FLOORS
from coursebuild.numerics.scene import ExactMotion, SceneError
from coursebuild.numerics.settings import CONES

EVALUATIONS, QUICK_EVALUATIONS = 2_000_000, 400_000
"""Accelerations that a reference may take."""
FINER, QUICK_FINER = 16, 8
"""Times by which steps of a `self` reference are shorter than the shortest that is measured."""
PARTED = 0.01
"""Where two runs of the engine part, so that neither is a reference: rad, or relative to the
extent."""
FOREIGN = 1e-3
"""The difference from which on a closed form is that of another scene, in the same units."""
CONSERVED = 1e-8
"""Relative change, over the reference, of what is called conserved."""
_STEP = 1e-6
"""s, of the model whose accelerations are integrated: `refsafe` softens nothing then."""
_ELSEWHERE = "the engine in small steps tends elsewhere"


class KnownMotion(Struct, frozen=True):
    """The reference of a scene, from the first sample to the horizon."""

    kind: str
    """`closed`, `ode` or `self`."""
    source: str
    states: EngineStates
    other: EngineStates
    """Those of the second reference."""
    motion: Motion
    floor: Sizes
    """What it may be wrong by."""
    second: str
    """The source of the second reference."""
    agreement: float
    """The largest difference of the two, in m, rad, m/s and rad/s."""
    horizon: float
    """s."""
    note: str = ""
    """Why it is no better one; empty where it is the best there is."""


def find_reference(model: Any, first: Pilot, *, quick: bool = False) -> KnownMotion:
    """The reference of a scene.

    Raises:
        SceneError: the scenario names a closed form that is not this scene's.
    """
    wanted = first.scene.declared
    found, note = None, ""
    if first.smooth and wanted.reference != "self":
        try:
            found = _integrated(model, first, quick)
        except NoConvergenceError as error:
            note = f"no integration: {error}"
        if found is not None and not _tended(model, first, found):
            found, note = None, f"no integration: {_ELSEWHERE}"
            if wanted.reference == "ode":
                raise _no_integration(_ELSEWHERE, wanted)
    elif wanted.reference == "ode":
        raise _no_integration(f"there is {' and '.join(first.jumps)}", wanted)
    if found is None:
        found = replace(self_reference(model, first, quick=quick), note=note)
    if wanted.closed:
        problem, motion = closed_motion(model, first.scene, wanted, found.states.times)
        what, place = f"the closed form of `{wanted.closed}`", wanted.place("reference")
        source = problem.reference.source
        return _closed(model, found, motion, source, floor(problem), what, place)
    exact = None if wanted.reference else first.scene.exact
    if exact is None:
        return found
    motion = _exact_motion(model, first, exact, found)
    return _closed(
        model, found, motion, exact.span.path, ROUNDING, f"`{exact.span.path}`", exact.span
    )


def _exact_motion(model: Any, first: Pilot, exact: ExactMotion, second: KnownMotion) -> Motion:
    """What the course says of the motion; velocities of the second reference where it says none."""
    data, states = initial_data(first.scene.scenario, model), second.states
    qpos, qvel = exact.states(states.times, data.qpos.copy(), data.qvel.copy())
    found = replace(states, qpos=qpos, qvel=states.qvel if qvel is None else qvel)
    if (found.qpos.shape, found.qvel.shape) != (states.qpos.shape, states.qvel.shape):
        message = f"`{exact.span.path}` gives other numbers of coordinates than the model has"
        raise SceneError(message, exact.span, "they are those of `qpos`, and perhaps of `qvel`")
    return motion_of(model, found)


def _no_integration(why: str, declared: DeclaredScenario) -> SceneError:
    message = f"no integration can be the reference: {why}"
    help = "leave `reference` out: the engine itself in small steps is the reference then"
    return SceneError(message, declared.place("reference"), help)


def _integrated(model: Any, first: Pilot, quick: bool) -> KnownMotion:
    """By two methods over the engine's accelerations."""
    times = first.setup.scenario.times
    times = times[times <= first.horizon * (1 + 1e-9)]
    exact = with_integrator(model, Integrator.EULER, _STEP)
    exact.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    exact.opt.iterations, exact.opt.tolerance = max(100, int(exact.opt.iterations)), 0.0
    exact.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
    exact.actuator_actearly[:] = 0  # it looks ahead by a timestep, which tends to nothing
    most = QUICK_EVALUATIONS if quick else EVALUATIONS

    def run(method: Method) -> EngineStates:
        return forward_states(exact, first.scene.scenario, times, method, evaluations=most)

    states = run(partial(bulirsch_stoer, tolerance=1e-13))
    source = "Bulirsch–Stoer over mj_forward"
    other, second = run(dop853), "DOP853 over mj_forward"
    return _compared(model, "ode", source, states, second, other)


def _tended(model: Any, first: Pilot, found: KnownMotion) -> bool:
    setup = _until(first.setup, float(found.states.times[-1]))
    return tends_to(model, setup, found.states, min(first.scene.timesteps), PARTED)


def self_reference(model: Any, first: Pilot, *, quick: bool = False) -> KnownMotion:
    """By the engine itself in small steps, and in steps twice as long under another integrator."""
    step = min(first.scene.timesteps) / (QUICK_FINER if quick else FINER)
    found = []
    for integrator, length in ((Integrator.IMPLICITFAST, step), (Integrator.EULER, 2 * step)):
        fine = with_integrator(model, integrator, length)
        fine.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
        fine.opt.iterations = max(100, int(fine.opt.iterations))
        fine.opt.tolerance = min(1e-10, float(fine.opt.tolerance))
        run = simulate(_until(first.setup, first.horizon), fine)
        if not np.isfinite(run.states.qpos).all():
            raise SceneError(f"it diverges even at {step:g} s a step")
        found.append(run.states)
    beyond = np.flatnonzero(position_distances(model, found[0].qpos, found[1].qpos) > PARTED)
    good = max(1, int(beyond[0])) if beyond.size else len(found[0].times)
    states, other = (one.head(good) for one in found)
    source = f"the engine itself: implicitfast at {step:g} s, Newton's solver"
    second = f"the same under Euler at {2 * step:g} s"
    return _compared(model, "self", source, states, second, other)


def _until(setup: Setup, horizon: float) -> Setup:
    """The same until the horizon, a multiple of the sample."""
    return replace(setup, scenario=replace(setup.scenario, duration=horizon))


def _compared(
    model: Any,
    kind: str,
    source: str,
    states: EngineStates,
    second: str,
    other: EngineStates,
) -> KnownMotion:
    motion, horizon = motion_of(model, states), float(states.times[-1])
    gap = largest_errors(errors(motion, motion_of(model, other)))
    floor = gap.at_least(ROUNDING)
    return KnownMotion(kind, source, states, other, motion, floor, second, gap.largest, horizon)


def _closed(
    model: Any,
    second: KnownMotion,
    motion: Motion,
    source: str,
    least: Sizes,
    what: str,
    place: Span,
) -> KnownMotion:
    """A closed form, with what was integrated as the second reference."""
    gap = largest_errors(errors(motion, second.motion))
    states = states_of(model, motion, second.states)
    away = float(position_distances(model, states.qpos, second.states.qpos).max(initial=0.0))
    known = least
    if second.kind == "ode":
        if not away <= FOREIGN:
            message = f"{what} is not this scene's motion"
            help = f"the two are {away:.2g} apart (rad, or relative to the extent)"
            raise SceneError(message, place, help)
        known = least.at_least(gap)
    return replace(
        second,
        kind="closed",
        source=source,
        states=states,
        other=second.states,
        motion=motion,
        floor=known,
        second=second.source,
        agreement=gap.largest,
        note="",
    )


class Cone(Struct, frozen=True):
    """What errors under a cone are measured against."""

    known: KnownMotion
    model_error: float | None
    """What remains of the error however small the timestep, m or rad."""
    seen: float
    """The same in a picture, where it is not in the errors already."""
    sticks: Sticks | None = None
    """What sticks in the reference; `None` where nothing touches."""


def references(model: Any, first: Pilot, *, quick: bool = False) -> dict[str, Cone]:
    """By cone; by "" where nothing touches."""
    known, scene = find_reference(model, first, quick=quick), first.scene
    if not first.contact:
        return {"": Cone(known, None, 0.0)}
    limits = {}
    for cone, number in CONES.items():
        other = with_integrator(model, Integrator.EULER, scene.own)
        other.opt.cone = number
        limits[cone] = self_reference(other, first, quick=quick)
    found = {}
    for cone, limit in limits.items():
        truth = known if known.kind == "closed" else limits["elliptic"]
        sticks = sticking(model, scene, limit.states)
        if cone == "elliptic" and truth is limit:
            found[cone] = Cone(limit, None, 0.0, sticks)
            continue
        count = min(len(limit.states.times), len(truth.states.times))
        near, true = limit.states.head(count), truth.states.head(count)
        gap = largest_errors(errors(motion_of(model, near), motion_of(model, true))).place
        least = FLOORS * max(limit.floor.place, truth.floor.place)
        if truth is known:
            found[cone] = Cone(known, max(gap, least), 0.0, sticks)
        else:
            seen = visible_error(model, scene, near, true) if gap > least else 0.0
            found[cone] = Cone(limit, max(gap, least), seen, sticks)
    return found


def find_conserved(model: Any, first: Pilot, known: KnownMotion) -> tuple[float | None, bool]:
    """What the author says is conserved, or else what the reference conserves.

    What changes of energy are large against, J, and `None` where energy is not conserved; whether
    the angular momentum about the centre of mass is.
    """
    scenario = first.scene.scenario
    declared = first.scene.declared.conserved
    data, other = initial_data(scenario, model), initial_data(scenario, model)
    states = [(data.qpos, data.qvel), *zip(known.states.qpos, known.states.qvel, strict=True)]
    table = np.array([invariants(model, other, qpos, qvel) for qpos, qvel in states])
    run = Run(known.states, table[:, :2], table[:, 2:], 0.0, RunJudgement(RunStatus.OK))
    scale = energy_scale(run)
    if declared is not None:
        energy = "energy" in declared and scale > 0
        return scale if energy else None, "angular-momentum" in declared
    if not first.smooth or known.kind == "self":
        return None, False
    drifts = energy_drift(run), momentum_drift(run)
    steady = [drift is not None and abs(drift) < CONSERVED for drift in drifts]
    return scale if steady[0] else None, steady[1]


def energy_beyond(model: Any, first: Pilot, known: KnownMotion) -> float | None:
    """Mean kinetic energy beyond the horizon, J, in the smallest steps; `None` without such."""
    scenario = first.scene.scenario
    if known.horizon > scenario.duration - scenario.sample * 1.5:
        return None
    integrator = Integrator.RK4 if first.smooth else Integrator.IMPLICITFAST
    fine = with_integrator(model, integrator, min(first.scene.timesteps) / 2)
    run = simulate(first.setup, fine)
    mean = float(run.energy[1:][run.states.times > known.horizon * (1 + 1e-9), 1].mean())
    return mean if math.isfinite(mean) and mean > 0 else None
