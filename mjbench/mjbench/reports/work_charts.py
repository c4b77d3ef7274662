"""Charts of error against work: of a scenario, and of a hard case.

1. A line for each integrator goes from long timesteps to short ones, over those rows that have the
   scene's own solver, iterations and cone; the rows with others are small marks beside it. A mark
   is filled where no other is better; a ring is around the scene's own.
2. Where nothing was timed, work is counted in evaluations of the forward dynamics.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence

from mjbench.reports import Interval
from mjbench.reports.charts import (
    ON_FRONT,
    Chart,
    ChartLevel,
    ChartLine,
    ChartMark,
    ChartPoint,
    chart_point,
)
from mjbench.reports.model_report import CaseReport, ErrorLine
from mjbench.reports.scene_report import FLOORS, ErrorQuantity, ScenarioReport, WorkPrecisionRow
from mjbench.reports.shown_errors import (
    INTEGRATORS,
    SEEN,
    STEPPED,
    horizon_error_text,
    interval_text,
    seconds_text,
    setting_text,
    status_text,
)

_COST, _EVALUATIONS = "cost", "evaluations of the forward dynamics"


def scenario_charts(report: ScenarioReport) -> tuple[Chart, ...]:
    """The chart of error against cost, or evaluations; none where no row errs."""
    quantity = next((q for q in report.quantities if q.name == report.main), None)
    if quantity is None or not any(quantity.value_of(row) for row in report.rows):
        return ()
    is_timed = any(row.cost is not None and row.cost.value > 0 for row in report.rows)
    return (_chart(report, quantity, _COST if is_timed else _EVALUATIONS),)


def _chart(report: ScenarioReport, quantity: ErrorQuantity, work: str) -> Chart:
    works = _find_works(report)
    axis = work
    if work == _COST:
        base = "the scene’s own setting"
        if report.cost_of is not None:
            base = setting_text(report.cost_of, report.own_setting)
        axis = f"cost, relative to {base}"
    lines = _lines(lambda name: _points(report, quantity, works, name))
    visible = [point for line in lines for point in line.points if point.y is not None]
    marks = [ChartMark("front", ON_FRONT)] if any(p.full for p in visible) else []
    if not all(point.full for point in visible):
        luck = ", or it is luck" if any(row.lucky for row in report.rows) else ""
        marks.append(ChartMark("beaten", f"another is better, and worse in nothing{luck}"))
    if any(point.small for point in visible):
        marks.append(ChartMark("other", "other solver, iterations or cone"))
    own_names = (setting_text(row.setting, row.setting) for row in report.rows if row.own)
    marks += [ChartMark("own", f"the scene’s own: {name}") for name in own_names]
    losses = {"run lost": _lost(report), "past its horizon": _parted(report)}
    if words := [text for text, names in losses.items() if names]:
        marks.append(ChartMark("lost", ", or ".join(words)))
    return Chart(
        title=f"{report.title or report.name}: error of {quantity.label} against {work}",
        text=" ".join(_describe(report, quantity, lines, work)),
        axes=(axis, f"error: {quantity.label}"),
        lines=lines,
        least=quantity.least,
        levels=tuple(_levels(report, quantity)),
        marks=tuple(marks),
    )


def _lines(points: Callable[[str], Iterable[ChartPoint]]) -> tuple[ChartLine, ...]:
    """The lines of integrators that have points."""
    lines = (ChartLine(name, n, tuple(points(name))) for n, name in enumerate(INTEGRATORS))
    return tuple(line for line in lines if line.points)


def _levels(report: ScenarioReport, quantity: ErrorQuantity) -> Iterator[ChartLevel]:
    if quantity.name not in (SEEN.name, STEPPED.name):
        return
    yield ChartLevel(1.0, "just visible")
    baseline = report.own_setting
    model = report.contact_model.get(baseline.cone, 0.0) if baseline is not None else 0.0
    if quantity.name == STEPPED.name and baseline is not None and model:
        yield ChartLevel(model, f"the {baseline.cone} cone's own error")


def _points(
    report: ScenarioReport,
    quantity: ErrorQuantity,
    works: Sequence[Interval],
    name: str,
) -> Iterator[ChartPoint]:
    """The points of an integrator, from long timesteps to short ones."""
    baseline = report.own_setting
    rows = [
        (row, x)
        for row, x in zip(report.rows, works, strict=True)
        if row.setting.integrator == name and not row.idle
    ]
    for row, x in sorted(rows, key=lambda part: -part[0].setting.timestep):
        error = quantity.value_of(row) if row.status == "ok" else None
        yield chart_point(
            x,
            error,
            " · ".join(_point_title(report, row, error)),
            full=row.front,
            small=baseline is not None and row.setting.solver_settings != baseline.solver_settings,
            ringed=row.own,
        )


def _find_works(report: ScenarioReport) -> list[Interval]:
    """What each row costs; its evaluations where nothing was timed."""
    timed = [row for row in report.rows if row.cost is not None and row.cost.value > 0]
    works: list[Interval] = []
    for row in report.rows:
        x = row.cost
        if x is None or not x.value:  # its evaluations say about how much it would be
            alike = [peer for peer in timed if peer.setting.integrator == row.setting.integrator]
            rates = [peer.cost.value / peer.work for peer in alike or timed if peer.cost]
            value = row.work * (statistics.median(rates) if rates else 1.0)
            x = Interval(value, value, value)
        works.append(x)
    return works


def _lost(report: ScenarioReport) -> list[str]:
    """The integrators under which runs were lost."""
    return list(dict.fromkeys(r.setting.integrator for r in report.rows if r.status != "ok"))


def _parted(report: ScenarioReport) -> list[str]:
    """Those under which runs are too far from a chaotic motion to have an error."""
    return list(dict.fromkeys(r.setting.integrator for r in report.rows if r.parted is not None))


def _describe(
    report: ScenarioReport, quantity: ErrorQuantity, lines: Sequence[ChartLine], work: str
) -> Iterator[str]:
    yield from _describe_lines(lines, "at costs of {}" if work == _COST else "with {}")
    if lost := _lost(report):
        yield f"Runs were lost under {', '.join(lost)}."
    if parted := _parted(report):
        error = horizon_error_text(report.horizon_error)
        yield f"Runs are off by more than {error} under {', '.join(parted)}."
    if (baseline := report.own_setting) is not None:
        yield f"The scene’s own setting is {setting_text(baseline)}."
    if quantity.least > 0:
        yield f"No error below {quantity.least:.1e} is given."


def _describe_lines(lines: Sequence[ChartLine], amount: str) -> Iterator[str]:
    """What each line is from end to end; `amount` tells the work in its place of `{}`."""
    for line in lines:
        if visible := [point for point in line.points if point.y is not None]:
            errors = _range([point.y or 0.0 for point in visible], 2, "{1} to {0}")
            costs = _range([point.x for point in visible], 3, "{0} to {1}")
            yield f"{line.name}: errors {errors} {amount.format(costs)}."


def _range(values: Sequence[float], digits: int, words: str) -> str:
    least, largest = (f"{value:.{digits}g}" for value in (min(values), max(values)))
    return words.format(least, largest) if max(values) > min(values) else least


def _point_title(
    report: ScenarioReport, row: WorkPrecisionRow, error: float | None
) -> Iterator[str]:
    yield setting_text(row.setting)
    if row.parted is not None:
        yield f"off by {horizon_error_text(report.horizon_error)} after {seconds_text(row.parted)}"
    elif error is None:
        yield "; ".join((status_text(row.status), *row.reasons))
    else:
        yield f"error {error:.3g}"
    if row.cost is not None:
        yield f"cost {interval_text(row.cost)}"
    elif any(row.cost is not None for row in report.rows):
        yield "not timed"
    yield f"{row.steps} steps"
    if row.work > row.steps:
        yield f"{row.work} evaluations"
    if row.iterations is not None:
        yield f"{row.iterations:.6g} iterations of the solver"
    if row.lucky:
        yield f"luck: {row.lucky}"
    if row.own:
        yield "the scene’s own setting"
    if row.front:
        yield ON_FRONT
    elif row.dominated_by is not None:
        rival = setting_text(report.rows[row.dominated_by].setting, row.setting)
        yield f"{rival} is better, and worse in nothing"


def case_charts(report: CaseReport) -> tuple[Chart, ...]:
    """The charts of each error against processor time; none where that was not measured."""
    quantities = case_quantities(report) if report.costs else ()
    return tuple(_case_chart(report, quantity) for quantity in quantities)


def case_quantities(report: CaseReport) -> tuple[ErrorQuantity, ...]:
    """The first error that is resolved, and energy drift where energy is conserved."""
    units = {"position": "m or rad", "attitude": "rad", "velocity": "m/s or rad/s"}
    errors = (
        ErrorQuantity(
            part, f"error of {part} ({unit})", FLOORS * getattr(report.reference, part), False
        )
        for part, unit in units.items()
    )
    drift = ErrorQuantity("energy_drift", "energy drift, relative", 0.0, False)
    runs = [line for line in report.errors if line.status == "ok"]
    return (
        *[quantity for quantity in errors if quantity.is_resolved(runs)][:1],
        *[drift] * drift.is_resolved(runs),
    )


def step_cost(report: CaseReport, line: ErrorLine) -> Interval | None:
    """Processor time for a simulated second, s; `None` where the integrator was not timed."""
    costs = (cost.seconds for cost in report.costs if cost.integrator == line.integrator)
    step = next(costs, None)
    return None if step is None else step.scale(1 / line.timestep)


def _case_chart(report: CaseReport, quantity: ErrorQuantity) -> Chart:
    def points(integrator: str) -> Iterator[ChartPoint]:
        for run in report.errors:
            x = step_cost(report, run)
            error = quantity.value_of(run) if run.status == "ok" else None
            if run.integrator == integrator and x is not None and error != 0:
                outcome = status_text(run.status)
                if error is not None:
                    outcome = f"{error:.3g}, {seconds_text(x.value, 3)}"
                title = f"{integrator} at {seconds_text(run.timestep)}: {outcome}"
                yield chart_point(x, error, title)

    lines = _lines(points)
    return Chart(
        title=f"{report.title}: {quantity.label} against processor time",
        text=" ".join(_describe_lines(lines, "at {} s")),
        axes=("processor time for a simulated second (s)", quantity.label),
        lines=lines,
        least=quantity.least,
    )
