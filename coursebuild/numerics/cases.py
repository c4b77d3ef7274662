"""What is measured on a hard case: errors and orders, largest stable timesteps, known quantities.

Entry points: `measure_case(problem)`; `measure(problem, integrator, timestep)`, one run of it;
`agreement(problem)`, of its two references; `closed_motion(model, scene, …)`, a closed form as the
motion of a model that begins like the hard case.

A run is judged first: the error of a run that was lost is not given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from coursebuild.core.model.scenarios import DeclaredScenario
from coursebuild.numerics.detector import driving_force
from coursebuild.numerics.engine import (
    EngineStates,
    compiled,
    initial_data,
    motion_of,
    refsafe_active,
    simulate,
)
from coursebuild.numerics.measure import (
    Errors,
    Sizes,
    energy_drift,
    errors,
    fitted_orders,
    momentum_drift,
    raised,
    reference_motion,
)
from coursebuild.numerics.problem import (
    STANDARD,
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems import problem_named
from coursebuild.numerics.reports.bench import OrderRow
from coursebuild.numerics.reports.cases import CaseReport, ErrorLine, FigureLine, ReferenceLine
from coursebuild.numerics.scene import Scene, SceneError
from coursebuild.numerics.stability import boundaries
from mjcourse.spatial import quat_conj, quat_mul


def measure_case(problem: Problem) -> CaseReport:
    """Everything that there is to measure on a problem."""
    runs = {one: [measure(problem, one, h) for h in problem.timesteps] for one in STANDARD}
    return CaseReport(
        name=problem.name,
        title=problem.title,
        case=problem.case,
        engine=mujoco.__version__,
        note=_note(problem),
        reference=_reference(problem),
        boundaries=boundaries(problem),
        figures=tuple(
            _checked(check, integrator)
            for check in problem.checks
            for integrator in check.integrators
        ),
        orders=tuple(orders(problem, lines) for lines in runs.values() if lines),
        errors=tuple(line for lines in runs.values() for line in lines),
    )


def _note(problem: Problem) -> str:
    model = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    driven = problem.search and driving_force(model, problem.scenario)
    said = (problem.note, f"energy is not judged: {driven}" if driven else "")
    return "; ".join(one for one in said if one)


def measure(problem: Problem, integrator: Integrator, timestep: float) -> ErrorLine:
    """Run a problem and compare it with its reference.

    Raises:
        ValueError: the timestep (s) does not divide the interval of the looks.
    """
    model = compiled(problem.mjcf, integrator, timestep)
    run = simulate(problem, model)
    found, reference = Errors(None, None, None), problem.reference
    if run.judgement.ok and reference is not None:
        exact = reference_motion(reference, tuple(run.states.times.tolist()))
        found = raised(errors(motion_of(model, run.states), exact), _floor(problem))
    return ErrorLine(
        integrator=integrator.value,
        timestep=timestep,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        position=found.position,
        attitude=found.attitude,
        velocity=found.velocity,
        energy_drift=energy_drift(run) if problem.energy_conserved else None,
        momentum_drift=momentum_drift(run) if problem.momentum_conserved else None,
        penetration=run.penetration,
        refsafe=refsafe_active(model),
    )


def orders(problem: Problem, lines: Sequence[ErrorLine]) -> OrderRow:
    """Orders of the integrator that the lines are of.

    None where the problem is not smooth: a slope would say nothing there.
    """
    integrator = lines[0].integrator
    if problem.reference is None or not problem.smooth:
        return OrderRow(integrator, None, None, None)
    runs = [(one.timestep, Errors(one.position, one.attitude, one.velocity)) for one in lines]
    return fitted_orders(integrator, runs, _floor(problem))


def agreement(problem: Problem) -> float | None:
    """The largest difference of the problem's two references over its duration.

    In m, rad, m/s or rad/s, whichever is larger; `None` where it has not two.
    """
    if problem.reference is None or problem.second is None:
        return None
    times = problem.scenario.times
    exact = reference_motion(problem.reference, tuple(times.tolist()))
    return errors(exact, problem.second.motion(times)).largest.largest


def _floor(problem: Problem) -> Sizes:
    floor = 0.0 if problem.reference is None else problem.reference.floor
    return Sizes(floor, floor, floor)


def _reference(problem: Problem) -> ReferenceLine | None:
    first, second = problem.reference, problem.second
    if first is None:
        return None
    name = "" if second is None else second.source
    return ReferenceLine(first.kind, first.source, first.floor, name, agreement(problem))


def _checked(check: ScalarCheck, integrator: Integrator) -> FigureLine:
    measured, exact = check.measure(integrator), check.expected(integrator)
    return FigureLine(
        check.name,
        check.unit,
        integrator.value,
        measured if math.isfinite(measured) else None,
        exact,
        check.source,
    )


# ----------------------------------------------------------------------------------- closed forms


def closed_motion(
    model: Any, scene: Scene, declared: DeclaredScenario, times: Array
) -> tuple[Reference, Motion]:
    """The reference that a scenario names, and its motion begun where the scene begins.

    Raises:
        SceneError: the scene begins otherwise than the hard case, but for the place of free bodies.
    """
    problem, place = problem_named(declared.closed), declared.place("reference")
    assert problem.reference is not None
    there = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    if (there.jnt_type.tolist(), there.nq) != (model.jnt_type.tolist(), model.nq):
        message = f"the model has other joints than the hard case `{declared.closed}`"
        raise SceneError(message, place)
    here, start = _start(model, scene.scenario), _start(there, problem.scenario)
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
        message = f"the scenario begins otherwise than the hard case `{declared.closed}`"
        raise SceneError(message, place, "its closed form holds for its own beginning only")
    turn = quat_mul(here.attitude, quat_conj(start.attitude))
    motion = problem.reference.motion(times)
    attitude = quat_mul(turn, motion.attitude)
    return problem.reference, Motion(times, motion.position + shift, attitude, motion.velocity)


def _start(model: Any, scenario: Scenario) -> Motion:
    data = initial_data(scenario, model)
    return motion_of(
        model, EngineStates(np.zeros(1), data.qpos[None], data.qvel[None], data.act[None])
    )
