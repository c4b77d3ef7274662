"""The plots of reports as SVG: error against cost, of a scenario or a hard case, and sweeps.

Entry points: `plot_svg(report, …)`, of a scenario, from `work_precision(report)`; of a hard case
`case_quantities(report)`, the errors to draw, and `case_svg(report, quantity, name)`;
`sweep_svg(sweep, …)`.

1. A line for each integrator goes from long timesteps to short ones, over those rows that have the
   scene's own solver, iterations and cone; the rows with others are small marks beside it.
2. A mark is filled where the setting is on the Pareto front, and hollow where another one is
   better. A ring is around the scene's own setting. Bars are the intervals of the costs.
3. The cost of a row that was not timed is estimated from the evaluations of the forward dynamics.
   Where nothing at all was timed, these stand in for the cost.
4. A sweep has a row for each value, and for each figure a scale beside it. A dot is a figure, a bar
   its interval; a line joins the values of one parameter, and a ring marks the model's own value. A
   scale is logarithmic where its figures differ by much.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from coursebuild.core.drawing.scales import Scale, log, shorten_to_width, text_width
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.case_report import CaseReport
from coursebuild.numerics.reports.chart import (
    FINE,
    MARK,
    NARROW_SIZE,
    PAIR_SIZE,
    ROW,
    SIZE,
    TICK_SIZE,
    WIDE_SIZE,
    Chart,
    Entry,
    Line,
    Point,
    bar,
    chart_svg,
    colour,
    key,
    label,
    line_look,
    path,
    ring,
    svg,
    symbol,
    symbols,
)
from coursebuild.numerics.reports.scene_report import (
    FIGURES,
    FLOORS,
    ScenarioReport,
    SweepReport,
    SweepRow,
    WorkPrecisionRow,
    cell,
    figure_interval,
    shown_figures,
)
from coursebuild.numerics.reports.shown_errors import (
    INTEGRATORS,
    Quantity,
    interval_text,
    is_idle,
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
    is_counted = any(row.evaluations for row in report.rows)
    work = "evaluations of the forward dynamics" if is_counted else "steps"
    base = "the scene’s own setting"
    if report.cost_of is not None:
        base = setting_text(report.cost_of, report.own_setting)
    integrators = {row.setting.integrator for row in report.rows}
    lines = tuple(
        _line(report, quantity, timed, name) for name in INTEGRATORS if name in integrators
    )
    return Chart(
        title=(
            f"{report.title or report.name}: error of {quantity.label} "
            f"against {'cost' if timed else work}"
        ),
        text=" ".join(_describe(report, quantity, lines)),
        axes=(f"cost, relative to {base}" if timed else work, f"error: {quantity.label}"),
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
    baseline = report.own_setting
    points = []
    rows = [r for r in report.rows if r.setting.integrator == name and not is_idle(r)]
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
    """The cost of a row; estimated from its evaluations, or steps, where it was not timed."""
    if row in timed and row.cost is not None:
        return row.cost
    peers = [peer for peer in timed if peer.setting.integrator == row.setting.integrator] or timed
    rates = [peer.cost.value / _work(peer) for peer in peers if peer.cost is not None]
    value = _work(row) * (statistics.median(rates) if rates else 1.0)
    return Interval(value, value, value)


def _work(row: WorkPrecisionRow) -> int:
    return max(row.evaluations or row.steps, 1)


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
    if row.evaluations > row.steps:
        yield f"{row.evaluations} evaluations"
    if row.iterations is not None:
        yield f"{row.iterations:.6g} iterations of the solver"
    if row.lucky:
        yield f"luck: {row.lucky}"
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


_SPREAD = 20.0
"""A scale is logarithmic where its figures differ by more than this factor."""
_MAX_FIGURES = 3
"""The most figures that are drawn; all are in the table."""
_GAP = 18.0
"""Between two scales."""


def sweep_svg(sweep: SweepReport, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where nothing was measured.

    Args:
        sweep: what to draw.
        name: unique among the plots on the page, as ids are made from it.
        narrow: for narrow screens: the scales stand below each other.
    """
    figures = shown_figures(sweep)[:_MAX_FIGURES]
    width, _ = NARROW_SIZE if narrow else WIDE_SIZE
    if not figures:
        return ""
    texts = [*(f"  {row.value}" for row in sweep.rows), *(row.parameter for row in sweep.rows)]
    left = min(0.45 * width, max(text_width(text, TICK_SIZE) for text in texts) + 16)
    column_count = 1 if narrow else len(figures)
    scale_width = (width - left - 14 - _GAP * (column_count - 1)) / column_count
    parts: list[str] = []
    top = bottom = 0.0
    for n, figure in enumerate(figures):
        start = left + (n % column_count) * (scale_width + _GAP)
        scale = _scale(sweep.rows, figure, start, start + scale_width)
        names = left if n % column_count == 0 else 0.0
        bottom = _panel(parts, sweep, figure, scale, top, names)
        top = bottom if narrow else top
    if any(row.own for row in sweep.rows):
        key_svg, bottom = key([Entry("own", "as the model is")], 6.0, bottom + 20, width)
        parts.append(key_svg)
    title = f"{sweep.title}: {', '.join(FIGURES[figure] for figure in figures)}"
    return svg("".join(parts), (width, bottom), name, (title, _describe_sweep(sweep, figures)))


def _scale(rows: Sequence[SweepRow], figure: str, left: float, right: float) -> Scale:
    intervals = [figure_interval(row, figure) for row in rows]
    values = [
        x for interval in intervals if interval is not None for x in (interval.low, interval.high)
    ]
    low, high = min(values, default=0.0), max(values, default=1.0)
    powers = low > 0 and high > _SPREAD * low
    if powers:
        low, high = log(low), log(high)
    elif low < 0.5 * high:
        low = min(low, 0.0)
    pad = 0.08 * (high - low) or 0.05 * abs(high) or 1.0
    return Scale(left, right, low - pad, high + pad, powers)


def _panel(
    parts: list[str], sweep: SweepReport, figure: str, scale: Scale, top: float, names: float
) -> float:
    """Add one figure of all rows, with their names where there is room; return its lower end."""
    y = top + 34
    ticks = scale.ticks(max(2, int((scale.end - scale.start) / 56)))
    title = shorten_to_width(FIGURES[figure], scale.end - scale.start + 10, SIZE)
    parts.append(label(scale.start, top + 14, title))
    groups = [list(rows) for _, rows in groupby(sweep.rows, key=lambda row: row.parameter)]
    row_parts: list[str] = []
    for number, rows in enumerate(groups):
        if names:
            head = shorten_to_width(rows[0].parameter, names - 8, TICK_SIZE)
            row_parts.append(label(2, y + 4, head, f'{FINE} font-weight="600"'))
        row_parts += _group(rows, figure, scale, y + ROW, number, names)
        y += ROW * (len(rows) + 1) + 4
    lines = [f"M{x:.1f} {top + 22:.1f}V{y - 10:.1f}" for x, _ in ticks]
    parts.append(path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"'))
    parts += row_parts
    parts += [label(x, y + 4, text, f'text-anchor="middle" {FINE}') for x, text in ticks]
    return y + 12


def _group(
    rows: Sequence[SweepRow], figure: str, scale: Scale, top: float, number: int, names: float
) -> Iterator[str]:
    places = [(figure_interval(row, figure), top + ROW * n) for n, row in enumerate(rows)]
    for (start, y), (end, end_y) in pairwise(places):
        if start is not None and end is not None:
            d = f"M{scale(start.value):.1f} {y:.1f}L{scale(end.value):.1f} {end_y:.1f}"
            yield path(d, line_look(number))
    for row, (interval, y) in zip(rows, places, strict=True):
        if names:
            yield label(names - 8, y + 4, row.value, f'text-anchor="end" {FINE}')
        if interval is None:
            text = "" if row.status == "ok" else row.status
            yield label(scale.start, y + 4, text, FINE)
            continue
        x, title = scale(interval.value), f"{row.parameter} {row.value}: {cell(row, figure)}"
        yield path(bar(scale(interval.low), scale(interval.high), y), f'stroke="{colour(number)}"')
        yield symbols(number, [symbol(number, x, y, MARK, full=True, title=title)])
        if row.own:
            yield ring(x, y, 7)


def _describe_sweep(sweep: SweepReport, figures: Sequence[str]) -> str:
    return " ".join(
        f"{row.parameter} {row.value}: "
        + ", ".join(f"{FIGURES[figure]} {cell(row, figure) or row.status}" for figure in figures)
        + "."
        for row in sweep.rows
    )
