"""What is measured on a hard case: errors and orders, largest stable timesteps, known quantities.

Entry points: `measure_case(problem, machine, clock)`; `measure(problem, integrator, timestep)`, one
run of it; `floor(problem)`, how well its motion is known; `closed_motion(model, scene, …)`, a
closed form as the motion of a model that begins like the hard case.

A run is judged first: the error of a run that was lost is not given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from msgspec.structs import asdict, astuple

from coursebuild.core.model.results import Machine
from coursebuild.core.model.scenarios import DeclaredScenario
from coursebuild.numerics.detector import driving_force
from coursebuild.numerics.engine import (
    EngineStates,
    compile_model,
    full_state,
    initial_data,
    motion_of,
    refsafe_active,
    simulate,
)
from coursebuild.numerics.forward import forward_motion
from coursebuild.numerics.measure import (
    energy_drift,
    errors,
    fitted_orders,
    largest_errors,
    momentum_drift,
    reference_motion,
)
from coursebuild.numerics.problem import (
    ROUNDING,
    STANDARD,
    Array,
    Integrator,
    Motion,
    Problem,
    ScalarCheck,
    Scenario,
    SecondReference,
    Sizes,
)
from coursebuild.numerics.problems import all_problems
from coursebuild.numerics.reports.bench import Errors, OrderRow
from coursebuild.numerics.reports.cases import (
    CaseReport,
    ErrorLine,
    FigureLine,
    ReferenceLine,
    StepCost,
)
from coursebuild.numerics.scene import Scene, SceneError
from coursebuild.numerics.stability import boundaries
from coursebuild.numerics.timing import Clock, scenario_job, time_jobs
from mjcourse.spatial import quat_conj, quat_mul

_ENGINE = SecondReference("MuJoCo’s accelerations over the MJCF, DOP853", forward_motion)
"""Shares nothing with MuJoCo's integrators."""


class DisagreementError(ArithmeticError):
    """One of the references of a hard case is wrong."""


def measure_case(problem: Problem, machine: Machine, clock: Clock) -> CaseReport:
    """Everything that there is to measure on a problem.

    Raises:
        DisagreementError: its two references differ by more than they may.
    """
    first, second = problem.reference, _second_reference(problem)
    reference = ReferenceLine(first.kind, first.source, second.source, *astuple(floor(problem)))
    runs = {one: [measure(problem, one, h) for h in problem.timesteps] for one in STANDARD}
    return CaseReport(
        name=problem.name,
        title=problem.title,
        case=problem.case,
        machine=machine,
        note=_note(problem),
        reference=reference,
        boundaries=boundaries(problem),
        figures=tuple(
            _checked(check, integrator)
            for check in problem.checks
            for integrator in check.integrators
        ),
        orders=tuple(orders(problem, lines) for lines in runs.values() if lines),
        errors=tuple(line for lines in runs.values() for line in lines),
        costs=_costs(problem, runs, clock),
    )


def _costs(
    problem: Problem, runs: Mapping[Integrator, Sequence[ErrorLine]], clock: Clock
) -> tuple[StepCost, ...]:
    """What a step takes, at the longest timestep of which the run went well."""
    jobs, names, counts = [], [], []
    for integrator, lines in runs.items():
        step = next((one.timestep for one in lines if one.status == "ok"), None)
        if step is not None:
            model = compile_model(problem.mjcf, integrator, step)
            state = full_state(model, initial_data(problem.scenario, model))
            jobs.append(scenario_job(model, [(problem.scenario, state)], step))
            names.append(integrator.value)
            counts.append(round(problem.scenario.duration / step))
    found = time_jobs(jobs, 0, clock, quick=True) if jobs else ()
    return tuple(
        StepCost(name, one.nanoseconds.scaled(1e-9 / count))
        for name, count, one in zip(names, counts, found, strict=True)
    )


def _note(problem: Problem) -> str:
    model = compile_model(problem.mjcf, Integrator.EULER, 1e-3)
    driven = problem.search and driving_force(model, problem.scenario)
    said = (problem.note, f"energy is not judged: {driven}" if driven else "")
    return "; ".join(one for one in said if one)


def measure(problem: Problem, integrator: Integrator, timestep: float) -> ErrorLine:
    """Run a problem and compare it with its reference.

    Raises:
        ValueError: the timestep (s) does not divide the interval of the looks.
    """
    model = compile_model(problem.mjcf, integrator, timestep)
    run = simulate(problem, model)
    found = Errors(None, None, None)
    if run.judgement.ok:
        exact = reference_motion(problem.reference, tuple(run.states.times.tolist()))
        found = errors(motion_of(model, run.states), exact, floor(problem))
    return ErrorLine(
        **asdict(found),
        integrator=integrator.value,
        timestep=timestep,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
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
    if not problem.smooth:
        return OrderRow(integrator, None, None, None)
    runs = [(one.timestep, one) for one in lines]
    return fitted_orders(integrator, runs, floor(problem))


@lru_cache(maxsize=64)
def floor(problem: Problem) -> Sizes:
    """What the motion is not known better than: how far its two references are apart.

    Raises:
        DisagreementError: they differ by more than they may, so that one of them is wrong.
    """
    times = problem.scenario.times
    exact = reference_motion(problem.reference, tuple(times.tolist()))
    second = _second_reference(problem).motion(problem.mjcf, problem.scenario, times)
    gap = largest_errors(errors(second, exact))
    for part in ("position", "attitude", "velocity"):
        found, most = getattr(gap, part), getattr(problem.precision, part)
        if not found <= most:
            message = f"the references of `{problem.name}` differ by {found:.2g} in {part}"
            raise DisagreementError(f"{message}, where {most:.0e} is said")
    return gap.at_least(ROUNDING)


def _second_reference(problem: Problem) -> SecondReference:
    return problem.second or _ENGINE


def _checked(check: ScalarCheck, integrator: Integrator) -> FigureLine:
    found, exact = check.measure(integrator), check.expected(integrator)
    spread = None
    if not isinstance(found, float):
        low, found, high = np.quantile(found, (0.1, 0.5, 0.9), method="nearest").tolist()
        spread = (low, high) if math.isfinite(high) else None
    return FigureLine(
        check.name,
        check.unit,
        integrator.value,
        found if math.isfinite(found) else None,
        exact,
        check.source,
        spread,
    )


def closed_motion(
    model: Any, scene: Scene, declared: DeclaredScenario, times: Array
) -> tuple[Problem, Motion]:
    """The hard case that a scenario names, and its motion begun where the scene begins.

    Raises:
        SceneError: the scene begins otherwise than the hard case, but for the place of free bodies.
    """
    problem, place = all_problems()[declared.closed], declared.place("reference")
    there = compile_model(problem.mjcf, Integrator.EULER, 1e-3)
    if (there.jnt_type.tolist(), there.nq) != (model.jnt_type.tolist(), model.nq):
        message = f"the model has other joints than the hard case `{declared.closed}`"
        raise SceneError(message, place)
    here, start = _start(model, scene.scenario), _start(there, problem.scenario)
    shift = here.position - start.position
    of_free = model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
    widths = np.where(of_free, 3, model.jnt_type != mujoco.mjtJoint.mjJNT_BALL)
    free = np.repeat(of_free, widths)
    speeds = np.abs(here.velocity - start.velocity).max(initial=0.0)
    if np.abs(shift[:, ~free]).max(initial=0.0) > 1e-9 or speeds > 1e-9:
        message = f"the scenario begins otherwise than the hard case `{declared.closed}`"
        raise SceneError(message, place, "its closed form holds for its own beginning only")
    turn = quat_mul(here.attitude, quat_conj(start.attitude))
    motion = problem.reference.solution.motion(times)
    attitude = quat_mul(turn, motion.attitude)
    return problem, Motion(times, motion.position + shift, attitude, motion.velocity)


def _start(model: Any, scenario: Scenario) -> Motion:
    data = initial_data(scenario, model)
    return motion_of(
        model, EngineStates(np.zeros(1), data.qpos[None], data.qvel[None], data.act[None])
    )
