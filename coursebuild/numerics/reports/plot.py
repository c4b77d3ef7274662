"""The work–precision plot of a scenario or a hard case as SVG: error against cost.

Entry points: `plot_svg(report, …)`; `work_precision(report)`, what it shows; of a hard case
`case_quantities(report)`, what can be drawn, and `case_svg(report, quantity, name)`.

1. A line for each integrator goes from long timesteps to short ones, over those rows that have the
   scene's own solver, iterations and cone; the rows with others are small marks beside it.
2. A mark is filled where the setting is on the Pareto front, and hollow where another one is
   better. A ring is around the scene's own setting. Bars are the intervals of the costs.
3. A row that was not timed is put where its number of steps says: time goes by steps. Where nothing
   at all was timed, the number of steps stands in for the cost.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence

from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import FLOORS, ScenarioReport, WorkPrecisionRow
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.chart import BESIDE, NARROW, WIDE, Chart, Line, Point, chart_svg
from coursebuild.numerics.reports.strokes import Entry
from coursebuild.numerics.reports.text import (
    KNOWN,
    Quantity,
    interval_text,
    seconds_text,
    setting_text,
    status_text,
    telling,
)


def plot_svg(report: ScenarioReport, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where no row of the scenario has an error.

    Args:
        report: of the scenario.
        name: unlike those of all other plots on the page: what describes it has an id.
        narrow: for narrow screens: the text has the same size there.
    """
    chart = work_precision(report)
    return "" if chart is None else chart_svg(chart, name, NARROW if narrow else WIDE)


def work_precision(report: ScenarioReport) -> Chart | None:
    """What is drawn; `None` where no row has an error."""
    quantity = telling(report)
    if quantity is None:
        return None
    timed = [row for row in report.rows if row.cost is not None and row.cost.value > 0]
    measured = {row.setting.integrator for row in report.rows}
    lines = tuple(_line(report, quantity, timed, name) for name in KNOWN if name in measured)
    return Chart(
        title=(
            f"{report.title or report.name}: error of {quantity.label} "
            f"against {'cost' if timed else 'steps'}"
        ),
        text=" ".join(_said(report, quantity, lines)),
        axes=(
            "cost, relative to the scene’s own setting" if timed else "steps",
            f"error: {quantity.label}",
        ),
        lines=lines,
        least=quantity.least,
        one="just visible" if quantity.name == "seen" else "",
        marks=tuple(_marks(report, lines)),
    )


def _line(
    report: ScenarioReport,
    quantity: Quantity,
    timed: Sequence[WorkPrecisionRow],
    name: str,
) -> Line:
    """The rows of an integrator."""
    own = report.own
    points = []
    rows = [row for row in report.rows if row.setting.integrator == name]
    for row in sorted(rows, key=lambda row: -row.setting.timestep):
        error = quantity.of(row) if row.status == "ok" else None
        points.append(
            Point(
                _cost(row, timed),
                error,
                " · ".join(_told(report, row, error, timed=bool(timed))),
                full=row.front,
                small=own is not None and row.setting.solving != own.solving,
                ringed=row.own,
            )
        )
    return Line(name, KNOWN.index(name), tuple(points))


def _cost(row: WorkPrecisionRow, timed: Sequence[WorkPrecisionRow]) -> Interval:
    """What a row costs; of one that was not timed, what its number of steps says."""
    if row in timed and row.cost is not None:
        return row.cost
    like = [one for one in timed if one.setting.integrator == row.setting.integrator] or timed
    rates = [one.cost.value / max(one.steps, 1) for one in like if one.cost is not None]
    value = max(row.steps, 1) * (statistics.median(rates) if rates else 1.0)
    return Interval(value, value, value)


def _marks(report: ScenarioReport, lines: Sequence[Line]) -> Iterator[Entry]:
    """What marks mean: only those that there are."""
    points = [point for line in lines for point in line.points]
    drawn = [point for line in lines for point in line.drawn]
    if any(point.full for point in drawn):
        yield Entry("front", "on the Pareto front")
    if not all(point.full for point in drawn):
        yield Entry("beaten", "another is better")
    if any(point.small for point in drawn):
        yield Entry("other", "other solver, iterations or cone")
    for row in report.rows:
        if row.own:
            yield Entry("own", f"the scene’s own: {setting_text(row.setting, row.setting)}")
    if len(drawn) < len(points):
        yield Entry("lost", "run lost")


def _said(report: ScenarioReport, quantity: Quantity, lines: Sequence[Line]) -> Iterator[str]:
    """What is to be seen."""
    for line in lines:
        if line.drawn:
            errors = _range([point.y or 0.0 for point in line.drawn], 2, "{1} to {0}")
            costs = _range([point.x.value for point in line.drawn], 3, "{0} to {1}")
            yield f"{line.name}: errors {errors} at costs of {costs}."
    lost = [line.name for line in lines if len(line.drawn) < len(line.points)]
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
    least, largest = (f"{one:.{digits}g}" for one in (min(values), max(values)))
    return words.format(least, largest) if max(values) > min(values) else least


def _told(
    report: ScenarioReport, row: WorkPrecisionRow, error: float | None, *, timed: bool
) -> Iterator[str]:
    """What a point says when it is pointed at."""
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
    """The error that says most, and energy drift where energy is conserved."""
    known = report.reference
    errors = (
        Quantity("position", "error of position (m or rad)", FLOORS * known.position),
        Quantity("attitude", "error of attitude (rad)", FLOORS * known.attitude),
        Quantity("velocity", "error of velocity (m/s or rad/s)", FLOORS * known.velocity),
    )
    drift = Quantity("energy_drift", "energy drift, relative")
    runs = [line for line in report.errors if line.status == "ok"]
    return (*[one for one in errors if one.tells(runs)][:1], *[drift] * drift.tells(runs))


def case_svg(report: CaseReport, quantity: Quantity, name: str) -> str:
    """The plot as an `svg` element; empty where nothing was timed.

    `name` is unlike those of all other plots on the page.
    """
    lines = tuple(
        Line(integrator, number, tuple(points))
        for number, integrator in enumerate(KNOWN)
        if (points := [*_case_points(report, quantity, integrator)])
    )
    chart = Chart(
        title=f"{report.title}: {quantity.label} against processor time",
        text=" ".join(_case_range(line) for line in lines if line.drawn),
        axes=("processor time for a simulated second (s)", quantity.label),
        lines=lines,
        least=quantity.least,
    )
    return chart_svg(chart, name, BESIDE)


def _case_points(report: CaseReport, quantity: Quantity, integrator: str) -> Iterator[Point]:
    """By timestep; without runs of which nothing is off, for which there is no place."""
    for run in report.errors:
        cost = report.cost(run)
        if run.integrator != integrator or cost is None:
            continue
        if run.status != "ok":
            told = f"{integrator} at {seconds_text(run.timestep)}: {status_text(run.status)}"
            yield Point(cost, None, told)
        elif error := quantity.of(run):
            yield Point(cost, error, f"{integrator}: {error:.3g} at {seconds_text(cost.value, 3)}")


def _case_range(line: Line) -> str:
    (x0, y0), *_, (x1, y1) = [(p.x.value, p.y) for p in (*line.drawn, line.drawn[-1])]
    return f"{line.name}: {y0:.2g} at {seconds_text(x0, 2)}, {y1:.2g} at {seconds_text(x1, 2)}."
