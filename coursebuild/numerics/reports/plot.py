"""The work–precision plot of a scenario or a hard case as SVG: error against cost.

Entry points: `plot_svg(report, …)`, of a scenario, from `work_precision(report)`; of a hard case
`case_quantities(report)`, the errors to draw, and `case_svg(report, quantity, name)`.

1. A line for each integrator goes from long timesteps to short ones, over those rows that have the
   scene's own solver, iterations and cone; the rows with others are small marks beside it.
2. A mark is filled where the setting is on the Pareto front, and hollow where another one is
   better. A ring is around the scene's own setting. Bars are the intervals of the costs.
3. The cost of a row that was not timed is estimated from its number of steps. Where nothing at all
   was timed, the number of steps stands in for the cost.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence

from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.chart import (
    NARROW_SIZE,
    PAIR_SIZE,
    WIDE_SIZE,
    Chart,
    Line,
    Point,
    chart_svg,
)
from coursebuild.numerics.reports.scene_report import FLOORS, ScenarioReport, WorkPrecisionRow
from coursebuild.numerics.reports.strokes import Entry
from coursebuild.numerics.reports.text import (
    INTEGRATORS,
    Quantity,
    interval_text,
    main_quantity,
    seconds_text,
    setting_text,
    status_text,
)


def plot_svg(report: ScenarioReport, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where no row of the scenario has an error.

    Args:
        report: of the scenario.
        name: unique among the plots on the page, as ids are made from it.
        narrow: for narrow screens: the text has the same size there.
    """
    chart = work_precision(report)
    return "" if chart is None else chart_svg(chart, name, NARROW_SIZE if narrow else WIDE_SIZE)


def work_precision(report: ScenarioReport) -> Chart | None:
    """The chart of error against cost; `None` where no row has an error."""
    quantity = main_quantity(report)
    if quantity is None:
        return None
    timed = [row for row in report.rows if row.cost is not None and row.cost.value > 0]
    integrators = {row.setting.integrator for row in report.rows}
    lines = tuple(
        _line(report, quantity, timed, name) for name in INTEGRATORS if name in integrators
    )
    return Chart(
        title=(
            f"{report.title or report.name}: error of {quantity.label} "
            f"against {'cost' if timed else 'steps'}"
        ),
        text=" ".join(_describe(report, quantity, lines)),
        axes=(
            "cost, relative to the scene’s own setting" if timed else "steps",
            f"error: {quantity.label}",
        ),
        lines=lines,
        least=quantity.least,
        unit_label="just visible" if quantity.name == "seen" else "",
        marks=tuple(_marks(report, lines)),
    )


def _line(
    report: ScenarioReport,
    quantity: Quantity,
    timed: Sequence[WorkPrecisionRow],
    name: str,
) -> Line:
    """The rows of an integrator."""
    baseline = report.own_setting
    points = []
    rows = [row for row in report.rows if row.setting.integrator == name]
    for row in sorted(rows, key=lambda row: -row.setting.timestep):
        error = quantity.value_of(row) if row.status == "ok" else None
        points.append(
            Point(
                _cost(row, timed),
                error,
                " · ".join(_point_title(report, row, error, timed=bool(timed))),
                full=row.front,
                small=baseline is not None
                and row.setting.solver_settings != baseline.solver_settings,
                ringed=row.own,
            )
        )
    return Line(name, INTEGRATORS.index(name), tuple(points))


def _cost(row: WorkPrecisionRow, timed: Sequence[WorkPrecisionRow]) -> Interval:
    """The cost of a row; estimated from its number of steps where it was not timed."""
    if row in timed and row.cost is not None:
        return row.cost
    peers = [peer for peer in timed if peer.setting.integrator == row.setting.integrator] or timed
    rates = [peer.cost.value / max(peer.steps, 1) for peer in peers if peer.cost is not None]
    value = max(row.steps, 1) * (statistics.median(rates) if rates else 1.0)
    return Interval(value, value, value)


def _marks(report: ScenarioReport, lines: Sequence[Line]) -> Iterator[Entry]:
    """The entries of the key, for the kinds of marks that occur."""
    points = [point for line in lines for point in line.points]
    visible = [point for line in lines for point in line.visible_points]
    if any(point.full for point in visible):
        yield Entry("front", "on the Pareto front")
    if not all(point.full for point in visible):
        yield Entry("beaten", "another is better")
    if any(point.small for point in visible):
        yield Entry("other", "other solver, iterations or cone")
    for row in report.rows:
        if row.own:
            yield Entry("own", f"the scene’s own: {setting_text(row.setting, row.setting)}")
    if len(visible) < len(points):
        yield Entry("lost", "run lost")


def _describe(report: ScenarioReport, quantity: Quantity, lines: Sequence[Line]) -> Iterator[str]:
    """Describe the plot in sentences."""
    for line in lines:
        if line.visible_points:
            errors = _range([point.y or 0.0 for point in line.visible_points], 2, "{1} to {0}")
            costs = _range([point.x.value for point in line.visible_points], 3, "{0} to {1}")
            yield f"{line.name}: errors {errors} at costs of {costs}."
    lost = [line.name for line in lines if len(line.visible_points) < len(line.points)]
    if lost:
        yield f"Runs were lost under {', '.join(lost)}."
    for row in report.rows:
        if row.own:
            yield f"The scene’s own setting is {setting_text(row.setting)}."
    if report.verdict.text:
        yield report.verdict.text
    if quantity.least > 0:
        yield f"No error below {quantity.least:.1e} is given."


def _range(values: Sequence[float], digits: int, words: str) -> str:
    """The least and the largest of values."""
    least, largest = (f"{value:.{digits}g}" for value in (min(values), max(values)))
    return words.format(least, largest) if max(values) > min(values) else least


def _point_title(
    report: ScenarioReport, row: WorkPrecisionRow, error: float | None, *, timed: bool
) -> Iterator[str]:
    """The parts of a point's tooltip."""
    yield setting_text(row.setting)
    if error is None:
        yield "; ".join((status_text(row.status), *row.reasons))
    else:
        yield f"error {error:.3g}"
    if row.cost is not None:
        yield f"cost {interval_text(row.cost)}"
    elif timed:
        yield "not timed"
    yield f"{row.steps} steps"
    if row.own:
        yield "the scene’s own setting"
    if row.front:
        yield "on the Pareto front"
    elif row.dominated_by is not None and 0 <= row.dominated_by < len(report.rows):
        better = setting_text(report.rows[row.dominated_by].setting, row.setting)
        yield f"{better} is better"


def case_quantities(report: CaseReport) -> tuple[Quantity, ...]:
    """The first error that is resolved, and energy drift where energy is conserved."""
    reference = report.reference
    errors = (
        Quantity("position", "error of position (m or rad)", FLOORS * reference.position),
        Quantity("attitude", "error of attitude (rad)", FLOORS * reference.attitude),
        Quantity("velocity", "error of velocity (m/s or rad/s)", FLOORS * reference.velocity),
    )
    drift = Quantity("energy_drift", "energy drift, relative")
    runs = [line for line in report.errors if line.status == "ok"]
    return (
        *[quantity for quantity in errors if quantity.is_resolved(runs)][:1],
        *[drift] * drift.is_resolved(runs),
    )


def case_svg(report: CaseReport, quantity: Quantity, name: str) -> str:
    """The plot as an `svg` element; empty where nothing was timed.

    `name` is unique among the plots on the page.
    """
    lines = tuple(
        Line(integrator, number, tuple(points))
        for number, integrator in enumerate(INTEGRATORS)
        if (points := [*_case_points(report, quantity, integrator)])
    )
    chart = Chart(
        title=f"{report.title}: {quantity.label} against processor time",
        text=" ".join(_case_range(line) for line in lines if line.visible_points),
        axes=("processor time for a simulated second (s)", quantity.label),
        lines=lines,
        least=quantity.least,
    )
    return chart_svg(chart, name, PAIR_SIZE)


def _case_points(report: CaseReport, quantity: Quantity, integrator: str) -> Iterator[Point]:
    """The runs of an integrator as points; those without an error have no place in the plot."""
    for run in report.errors:
        cost = report.cost(run)
        if run.integrator != integrator or cost is None:
            continue
        if run.status != "ok":
            title = f"{integrator} at {seconds_text(run.timestep)}: {status_text(run.status)}"
            yield Point(cost, None, title)
        elif error := quantity.value_of(run):
            yield Point(cost, error, f"{integrator}: {error:.3g} at {seconds_text(cost.value, 3)}")


def _case_range(line: Line) -> str:
    (x0, y0), *_, (x1, y1) = [
        (p.x.value, p.y) for p in (*line.visible_points, line.visible_points[-1])
    ]
    return f"{line.name}: {y0:.2g} at {seconds_text(x0, 2)}, {y1:.2g} at {seconds_text(x1, 2)}."
