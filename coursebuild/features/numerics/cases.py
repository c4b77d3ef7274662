"""Scenarios with a known motion as hard cases, what cases cost, and their plots."""

from __future__ import annotations

import math
from itertools import pairwise

from msgspec.structs import asdict

from coursebuild.core.model.measurements import (
    FLOORS,
    BoundaryLine,
    CaseReport,
    ErrorLine,
    Interval,
    MeasuredRun,
    ReferenceLine,
    SceneReport,
    StepCost,
    step_evaluations,
)
from coursebuild.core.model.scenarios import exact_file
from coursebuild.features.bench.chart import PAIR_SIZE, Chart, Line, Point, chart_svg
from coursebuild.features.bench.shown_errors import (
    EVALUATION_LABEL,
    INTEGRATORS,
    Quantity,
    seconds_text,
    status_text,
)


def cost_of(report: CaseReport, line: ErrorLine) -> Interval | None:
    """Processor time for a simulated second, s; `None` where the integrator was not timed."""
    step_costs = (cost.seconds for cost in report.costs if cost.integrator == line.integrator)
    step = next(step_costs, None)
    return None if step is None else step.scale(1 / line.timestep)


def cost_to(report: CaseReport, integrator: str, error: float) -> float | None:
    """The same for the timestep with a given error, m or rad; `None` where no run is as good.

    Between two runs the cost follows a power of the error. Nothing is extrapolated.
    """
    runs = sorted(
        (cost.value, max(pair[0] for pair in places))
        for line in report.errors
        if line.integrator == integrator and (cost := cost_of(report, line)) is not None
        if (places := [pair for pair in (line.position, line.attitude) if pair is not None])
    )
    if runs and runs[0][1] <= error:
        return runs[0][0]
    for (low_cost, high_error), (high_cost, low_error) in pairwise(runs):
        if low_error <= error < high_error:
            part = math.log(high_error / error) / math.log(high_error / low_error)
            return float(low_cost * (high_cost / low_cost) ** part)
    return None


def course_cases(report: SceneReport) -> tuple[CaseReport, ...]:
    """The scenarios of a model whose exact motion the course gives, or of which it knows theory."""
    file = exact_file(report.model)
    run_fields = MeasuredRun.__struct_fields__
    cases = []
    for scenario in report.scenarios:
        if scenario.source != file and not scenario.figures:
            continue
        usual = scenario.own_setting and scenario.own_setting.solver_settings
        rows = [row for row in scenario.rows if row.setting.solver_settings == usual]
        steps = {
            row.setting.integrator: row.seconds.scale(row.setting.timestep)
            for row in reversed(rows)
            if row.seconds is not None
        }
        floors = scenario.floor, scenario.floor, scenario.velocity_floor
        case = CaseReport(
            name=f"{report.model}/{scenario.name}",
            title=f"{report.model}: {scenario.title or scenario.name}",
            case=0,
            machine=report.machine,
            note="; ".join(scenario.notes),
            reference=ReferenceLine(scenario.reference, scenario.source, scenario.second, *floors),
            boundaries=tuple(BoundaryLine(**asdict(row)) for row in scenario.stable),
            figures=scenario.figures,
            orders=scenario.orders,
            errors=tuple(
                ErrorLine(
                    integrator=row.setting.integrator,
                    timestep=row.setting.timestep,
                    **{name: getattr(row, name) for name in run_fields},
                )
                for row in rows
            ),
            costs=tuple(StepCost(name, seconds) for name, seconds in steps.items()),
        )
        cases.append(case)
    return tuple(cases)


def case_quantities(report: CaseReport) -> tuple[Quantity, ...]:
    """The first error that is resolved, and energy drift where energy is conserved."""
    units = {"position": "m or rad", "attitude": "rad", "velocity": "m/s or rad/s"}
    errors = (
        Quantity(part, f"error of {part} ({unit})", FLOORS * getattr(report.reference, part))
        for part, unit in units.items()
    )
    drift = Quantity("energy_drift", "energy drift, relative")
    runs = [line for line in report.errors if line.status == "ok"]
    return (
        *[quantity for quantity in errors if quantity.is_resolved(runs)][:1],
        *[drift] * drift.is_resolved(runs),
    )


def case_svgs(report: CaseReport, quantity: Quantity, name: str) -> tuple[str, ...]:
    """The plots of an error against processor time, where it was measured, and evaluations."""
    charts = (_case_chart(report, quantity, is_time=is_time) for is_time in (True, False))
    svgs = (
        chart_svg(chart, f"{name}{suffix}", PAIR_SIZE)
        for chart, suffix in zip(charts, ("", "-evaluations"), strict=True)
    )
    return tuple(svg_text for svg_text in svgs if svg_text)


def _case_chart(report: CaseReport, quantity: Quantity, *, is_time: bool) -> Chart:
    work = "processor time" if is_time else EVALUATION_LABEL

    def amount(x: float, digits: int = 2) -> str:
        return seconds_text(x, digits) if is_time else f"{x:.{digits}g}"

    lines = []
    for number, integrator in enumerate(INTEGRATORS):
        points = []
        for run in report.errors:
            count = step_evaluations(run.integrator) / run.timestep
            x = cost_of(report, run) if is_time else Interval(count, count, count)
            if run.integrator != integrator or x is None:
                continue
            setting = f"{integrator} at {seconds_text(run.timestep)}"
            if run.status != "ok":
                points.append(Point(x, None, f"{setting}: {status_text(run.status)}"))
            elif error := quantity.value_of(run):
                points.append(Point(x, error, f"{setting}: {error:.3g}, {amount(x.value, 3)}"))
        lines += [Line(integrator, number, tuple(points))] if points else []
    texts = []
    for line in lines:
        if visible := line.visible_points:
            ends = (f"{p.y:.2g} at {amount(p.x.value)}" for p in (visible[0], visible[-1]))
            texts.append(f"{line.name}: {', '.join(ends)}.")
    return Chart(
        title=f"{report.title}: {quantity.label} against {work}",
        text=" ".join(texts),
        axes=(f"{work} for a simulated second{' (s)' * is_time}", quantity.label),
        lines=tuple(lines),
        least=quantity.least,
    )
