"""Measure a hard case: errors and orders, largest stable timesteps, known quantities.

A run is judged first: the error of a run that was lost is not given.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache

import numpy as np
from msgspec.structs import asdict, astuple

from mjbench import simulation
from mjbench.costs import Clock, scenario_job, time_jobs
from mjbench.derive import derive_case
from mjbench.detector import driving_force
from mjbench.integrate import forward_motion
from mjbench.linearization import find_rest, step_excess
from mjbench.machine import Machine
from mjbench.measure import (
    energy_drift,
    errors,
    fit_orders,
    largest_errors,
    momentum_drift,
    reference_motion,
)
from mjbench.problem import (
    ROUNDING,
    STANDARD,
    Integrator,
    Problem,
    ScalarCheck,
    SecondReference,
    Sizes,
)
from mjbench.reports.model_report import (
    CaseReport,
    ErrorLine,
    ReferenceLine,
    StepCost,
)
from mjbench.reports.scene_report import Errors, FigureLine, OrderRow
from mjbench.stability import boundaries

_ENGINE = SecondReference("MuJoCo’s accelerations over the MJCF, DOP853", forward_motion)
"""Shares nothing with MuJoCo's integrators."""
_LIMIT_WIDTH, _STILL = 2e-7, 2e-9
"""How near to a limit, relative to it, steps are tried on both sides, and the most growth in one
that is still rounding: there it is 1e-10 or less, and beyond a limit 6e-9 or more."""


class DisagreementError(ArithmeticError):
    """One of the references of a hard case, or theory of its steps, is wrong."""


def measure_case(problem: Problem, machine: Machine, clock: Clock) -> CaseReport:
    """Measure everything on a problem.

    Raises:
        DisagreementError: references differ too much, or theory is not that of the engine's steps.
    """
    first, second = problem.reference, problem.second or _ENGINE
    model = simulation.compile_model(problem.mjcf, Integrator.EULER, 1e-3)
    drivers = problem.search and driving_force(model, problem.scenario)
    notes = (problem.note, f"energy is not judged: {drivers}" if drivers else "")
    reference = ReferenceLine(first.kind, first.source, second.source, *astuple(floor(problem)))
    check_limits(problem)
    runs = {
        integrator: [measure(problem, integrator, h) for h in problem.timesteps]
        for integrator in STANDARD
    }
    # The time of a step is that at the longest timestep with which the run went well.
    timed_jobs = []
    for integrator, lines in runs.items():
        step = next((line.timestep for line in lines if line.status == "ok"), None)
        if step is not None:
            model = simulation.compile_model(problem.mjcf, integrator, step)
            timed_jobs.append(
                (integrator.value, step, scenario_job(model, [problem.scenario], step))
            )
    jobs, duration = [job for *_, job in timed_jobs], problem.scenario.duration
    timings = time_jobs(jobs, 0, clock, quick=True) if jobs else ()
    report = CaseReport(
        name=problem.name,
        title=problem.title,
        case=problem.case,
        machine=machine,
        note="; ".join(note for note in notes if note),
        reference=reference,
        boundaries=boundaries(problem),
        figures=tuple(measure_figures(problem, problem.checks)),
        orders=tuple(orders(problem, lines) for lines in runs.values() if lines),
        errors=tuple(line for lines in runs.values() for line in lines),
        costs=tuple(
            StepCost(name, timing.nanoseconds.scale(1e-9 * step / duration))
            for (name, step, _), timing in zip(timed_jobs, timings, strict=True)
        ),
    )
    return derive_case(report)


def measure(problem: Problem, integrator: Integrator, timestep: float) -> ErrorLine:
    """Run a problem with a timestep (s) that divides the sample; its errors and drifts."""
    model = simulation.compile_model(problem.mjcf, integrator, timestep)
    run = simulation.simulate(problem, model)
    run_errors = Errors(None, None, None)
    if run.judgement.ok:
        exact = reference_motion(problem.reference, tuple(run.states.times.tolist()))
        run_errors = errors(simulation.motion_of(model, run.states), exact, floor(problem))
    return ErrorLine(
        **asdict(run_errors),
        integrator=integrator.value,
        timestep=timestep,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        energy_drift=energy_drift(run.energy) if problem.energy_conserved else None,
        momentum_drift=momentum_drift(run.momentum) if problem.momentum_conserved else None,
        penetration=run.penetration,
        refsafe=simulation.refsafe_active(model),
    )


def orders(problem: Problem, lines: Sequence[ErrorLine]) -> OrderRow:
    """The orders of the integrator of these lines; none where the problem is not smooth."""
    integrator = lines[0].integrator
    if not problem.smooth:
        return OrderRow(integrator, None, None, None)
    runs = [(line.timestep, line) for line in lines]
    return fit_orders(integrator, runs, floor(problem))


def measure_figures(problem: Problem, checks: Iterable[ScalarCheck]) -> Iterator[FigureLine]:
    """Quantities as they are measured.

    Raises:
        DisagreementError: theory of a step is not what the engine does.
    """
    for check in checks:
        for integrator in check.integrators:
            figure, exact = check.measure(integrator), check.expected(integrator)
            spread = None
            if not isinstance(figure, float):
                quantiles = np.quantile(figure, (0.1, 0.5, 0.9), method="nearest")
                low, figure, high = quantiles.tolist()
                spread = (low, high) if math.isfinite(high) else None
            elif exact is not None and integrator in check.precise:
                gap = abs(figure - exact)
                if not gap <= check.precision:
                    raise DisagreementError(
                        f"theory of `{problem.name}` ({check.name}, {integrator.value}) differs "
                        f"from the engine by {gap:.2g}, where {check.precision:.0e} is said"
                    )
            value = figure if math.isfinite(figure) else None
            line = check.name, check.unit, integrator.value, value, exact, check.source, spread
            yield FigureLine(*line)


def check_limits(problem: Problem) -> None:
    """A `DisagreementError` where a formula for a limit is not that of the model's own steps."""
    if problem.limit is None:
        return
    growth = problem.growth or _growth_at_rest(problem)
    for integrator in Integrator:
        limit = problem.limit(integrator)
        if limit is None or not 0 < limit.timestep < math.inf:
            continue
        sides = (1 - _LIMIT_WIDTH, 1 + _LIMIT_WIDTH)
        before, after = (growth(integrator, limit.timestep * side) - 1 for side in sides)
        if not before <= _STILL < after:
            raise DisagreementError(
                f"`{problem.name}`: {limit.timestep:.8g} s under {integrator.value} is not where "
                f"its steps begin to grow ({limit.source})"
            )


def _growth_at_rest(problem: Problem) -> Callable[[Integrator, float], float]:
    model = simulation.compile_model(problem.mjcf, Integrator.RK4, min(problem.timesteps))
    rest = find_rest(model, problem.scenario)
    assert rest is not None, "a hard case without a rest says how it grows"
    return lambda integrator, step: 1 + step_excess(model, rest, integrator, step)


@lru_cache(maxsize=64)
def floor(problem: Problem) -> Sizes:
    """How well the motion is known: the distance of its two references.

    Raises:
        DisagreementError: they differ by more than they may, so that one of them is wrong.
    """
    times, gaps = problem.scenario.times, []
    for moments in (times, times - 0.75 * problem.scenario.sample):  # also between the samples
        exact = reference_motion(problem.reference, tuple(moments.tolist()))
        second = (problem.second or _ENGINE).motion(problem.mjcf, problem.scenario, moments)
        gaps.append(largest_errors(errors(second, exact)))
    for gap, part in itertools.product(gaps, ("position", "attitude", "velocity")):
        difference, most = getattr(gap, part), getattr(problem.precision, part)
        if not difference <= most:
            message = f"the references of `{problem.name}` differ by {difference:.2g} in {part}"
            raise DisagreementError(f"{message}, where {most:.0e} is said")
    return gaps[0].at_least(ROUNDING)
