"""The plots of reports on models as SVG: error against work, of a scenario, sweeps, and engines.

1. A line for each integrator goes from long timesteps to short ones, over those rows that have the
   scene's own solver, iterations and cone; the rows with others are small marks beside it. A mark
   is filled where the setting is on the Pareto front; a ring is around the scene's own.
2. Beside the cost, which is time, work is counted as it is on every machine: in evaluations of the
   forward dynamics, and in iterations of the solver. Each has a front of its own.
3. A sweep has a row for each value, and for each figure a scale beside it, which is logarithmic
   where its figures differ by much. A line joins the values of one parameter.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from msgspec.structs import replace

from coursebuild.core.drawing.scales import Scale, log, shorten_to_width, text_width
from coursebuild.core.model.measurements import (
    EngineScenario,
    Interval,
    ScenarioReport,
    SweepReport,
    SweepRow,
    WorkPrecisionRow,
)
from coursebuild.features.bench.chart import (
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
from coursebuild.features.bench.shown_errors import (
    EVALUATION_LABEL,
    FIGURES,
    INTEGRATORS,
    Quantity,
    cell,
    figure_interval,
    front,
    horizon_error_text,
    interval_text,
    is_idle,
    main_quantity,
    row_name,
    seconds_text,
    setting_text,
    shown_figures,
    status_text,
)


def plot_svgs(report: ScenarioReport, *, name: str, narrow: bool = False) -> tuple[str, ...]:
    """The plots of `work_precision` as `svg` elements, with a `name` that is unique on the page."""
    sizes = [WIDE_SIZE, PAIR_SIZE, PAIR_SIZE] if not narrow else [NARROW_SIZE] * 3
    return tuple(
        svg_text
        for number, (chart, size) in enumerate(zip(work_precision(report), sizes, strict=False))
        if (svg_text := chart_svg(chart, f"{name}-{number}" if number else name, size))
    )


_WORKS = {
    "cost": "cost",
    "evaluations": EVALUATION_LABEL,
    "iterations": "iterations of the solver",
}
"""What a setting costs: time, and what is the same on every machine."""
_AMOUNTS = {"cost": "at costs of {}", "evaluations": "with {}", "iterations": "with {}"}


def work_precision(report: ScenarioReport) -> tuple[Chart, ...]:
    """The charts of error against cost, evaluations, and where a solver runs, its iterations.

    None where no row errs.
    """
    quantity = main_quantity(report)
    if quantity is None or not any(quantity.value_of(row) for row in report.rows):
        return ()
    return tuple(
        _chart(report, quantity, work, works)
        for work in _WORKS
        if any(works := _find_works(report, work))
    )


def _chart(
    report: ScenarioReport, quantity: Quantity, work: str, works: Sequence[Interval | None]
) -> Chart:
    if work != "cost":
        pairs = list(zip(report.rows, works, strict=True))
        places = front([replace(row, cost=x) for row, x in pairs], quantity)
        rows = tuple(
            replace(row, front=place.front, dominated_by=place.dominated_by)
            for (row, _), place in zip(pairs, places, strict=True)
        )
        report = replace(report, rows=rows)
    label = axis = _WORKS[work]
    if work == "cost":
        base = "the scene’s own setting"
        if report.cost_of is not None:
            base = setting_text(report.cost_of, report.own_setting)
        axis = f"cost, relative to {base}"
    lines = tuple(
        Line(name, INTEGRATORS.index(name), points)
        for name in INTEGRATORS
        if (points := tuple(_points(report, quantity, works, name)))
    )
    visible = [point for line in lines for point in line.visible_points]
    marks = [Entry("front", "on the Pareto front")] if any(p.full for p in visible) else []
    if not all(point.full for point in visible):
        marks.append(Entry("beaten", "another is better"))
    if any(point.small for point in visible):
        marks.append(Entry("other", "other solver, iterations or cone"))
    own_names = (setting_text(row.setting, row.setting) for row in report.rows if row.own)
    marks += [Entry("own", f"the scene’s own: {name}") for name in own_names]
    losses = {"run lost": _lost(report), "past its horizon": _parted(report)}
    if words := [text for text, names in losses.items() if names]:
        marks.append(Entry("lost", ", or ".join(words)))
    return Chart(
        title=f"{report.title or report.name}: error of {quantity.label} against {label}",
        text=" ".join(_describe(report, quantity, lines, work)),
        axes=(axis, f"error: {quantity.label}"),
        lines=lines,
        least=quantity.least,
        unit_label="just visible" if quantity.name == "seen" else "",
        marks=tuple(marks),
    )


def _points(
    report: ScenarioReport,
    quantity: Quantity,
    works: Sequence[Interval | None],
    name: str,
) -> Iterator[Point]:
    """The points of an integrator, from long timesteps to short ones."""
    baseline = report.own_setting
    rows = [
        (row, x)
        for row, x in zip(report.rows, works, strict=True)
        if row.setting.integrator == name and not is_idle(row)
    ]
    for row, x in sorted(rows, key=lambda pair: -pair[0].setting.timestep):
        if x is None:
            continue
        error = quantity.value_of(row) if row.status == "ok" else None
        yield Point(
            x,
            error,
            " · ".join(_point_title(report, row, error)),
            full=row.front,
            small=baseline is not None and row.setting.solver_settings != baseline.solver_settings,
            ringed=row.own,
        )


def _find_works(report: ScenarioReport, work: str) -> list[Interval | None]:
    """What each row costs; nothing where that is not known of any."""
    rows = report.rows
    if work == "iterations":
        return [Interval(n, n, n) if n else None for n in (row.iterations for row in rows)]
    if work == "evaluations":
        return [Interval(n, n, n) for n in (float(row.work) for row in rows)]
    timed = [row for row in rows if row.cost is not None and row.cost.value > 0]
    works: list[Interval | None] = []
    for row in rows if timed else ():
        x = row.cost
        if x is None or not x.value:  # its evaluations say about how much it would be
            alike = [peer for peer in timed if peer.setting.integrator == row.setting.integrator]
            rates = [peer.cost.value / peer.work for peer in alike or timed if peer.cost]
            value = row.work * statistics.median(rates)
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
    report: ScenarioReport, quantity: Quantity, lines: Sequence[Line], work: str
) -> Iterator[str]:
    for line in lines:
        if line.visible_points:
            errors = _range([point.y or 0.0 for point in line.visible_points], 2, "{1} to {0}")
            costs = _range([point.x.value for point in line.visible_points], 3, "{0} to {1}")
            yield f"{line.name}: errors {errors} {_AMOUNTS[work].format(costs)}."
    if work != "cost":
        return  # the rest is said with the costs
    if lost := _lost(report):
        yield f"Runs were lost under {', '.join(lost)}."
    if parted := _parted(report):
        error = horizon_error_text(report.horizon_error)
        yield f"Runs are off by more than {error} under {', '.join(parted)}."
    for row in report.rows:
        if row.own:
            yield f"The scene’s own setting is {setting_text(row.setting)}."
    if report.verdict.text:
        yield report.verdict.text
    if quantity.least > 0:
        yield f"No error below {quantity.least:.1e} is given."


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
        yield "on the Pareto front"
    elif row.dominated_by is not None and 0 <= row.dominated_by < len(report.rows):
        better = setting_text(report.rows[row.dominated_by].setting, row.setting)
        yield f"{better} is better"


_SPREAD = 20.0
"""A scale is logarithmic where its figures differ by more than this factor."""
_MAX_FIGURES = 3
"""The most figures that are drawn; all are in the table."""
_GAP = 18.0
"""Between two scales."""


def sweep_svg(sweep: SweepReport, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where nothing was measured."""
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
        intervals = [figure_interval(row, figure) for row in sweep.rows]
        ends = [x for interval in intervals if interval for x in (interval.low, interval.high)]
        low, high = min(ends, default=0.0), max(ends, default=1.0)
        is_log = low > 0 and high > _SPREAD * low
        if is_log:
            low, high = log(low), log(high)
        elif low < 0.5 * high:
            low = min(low, 0.0)
        pad = 0.08 * (high - low) or 0.05 * abs(high) or 1.0
        scale = Scale(start, start + scale_width, low - pad, high + pad, is_log)
        names = left if n % column_count == 0 else 0.0
        bottom = _panel(parts, sweep, figure, scale, top, names)
        top = bottom if narrow else top
    if any(row.own for row in sweep.rows):
        key_svg, bottom = key([Entry("own", "as the model is")], 6.0, bottom + 20, width)
        parts.append(key_svg)
    title = f"{sweep.title}: {', '.join(FIGURES[figure] for figure in figures)}"
    cells = [
        (row, [f"{FIGURES[figure]} {cell(row, figure) or row.status}" for figure in figures])
        for row in sweep.rows
    ]
    text = " ".join(f"{row.parameter} {row.value}: {', '.join(texts)}." for row, texts in cells)
    return svg("".join(parts), (width, bottom), name, (title, text))


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


def engine_svg(report: EngineScenario, *, name: str, narrow: bool = False) -> str:
    """The time of a step by the number of worlds; empty where nothing was timed."""
    lines = []
    for number, row in enumerate(report.rows):
        points = tuple(
            Point(
                Interval(cost.worlds, cost.worlds, cost.worlds),
                cost.seconds.value * 1e6,
                f"{row_name(row)}, {cost.worlds:,} worlds: {seconds_text(cost.seconds.value, 3)}",
            )
            for cost in row.costs
            if cost.seconds is not None
        )
        lines += [Line(row_name(row), number, points)] if points else []
    text = " ".join(
        f"{line.name}: {', '.join(point.title.rsplit(', ', 1)[1] for point in line.points)}."
        for line in lines
    )
    chart = Chart(
        title=f"{report.title or report.name}: time of a step by the number of worlds",
        text=text,
        axes=("worlds simulated at once", "time of a step per world (µs)"),
        lines=tuple(lines),
        marks=(Entry("note", "lowest of at least 8 rounds"),),
    )
    return chart_svg(chart, name, NARROW_SIZE if narrow else WIDE_SIZE)
