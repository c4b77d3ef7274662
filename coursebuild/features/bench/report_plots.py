"""The plots of reports on models as SVG: error against work, of a scenario, sweeps, and engines.

A sweep has a row for each value, and for each figure a scale beside it, which is logarithmic
where its figures differ by much. A line joins the values of one parameter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from coursebuild.core.drawing.scales import Scale, log, shorten_to_width, text_width
from coursebuild.core.model.measurements import (
    Chart,
    ChartLine,
    ChartMark,
    ChartPoint,
    EngineScenario,
    ScenarioReport,
    SweepReport,
    SweepRow,
)
from coursebuild.core.pages.renderer import Strings
from coursebuild.features.bench.chart import (
    FINE,
    MARK,
    NARROW_SIZE,
    ROW,
    SIZE,
    TICK_SIZE,
    WIDE_SIZE,
    Entry,
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
from coursebuild.features.bench.grids import whole_number
from coursebuild.features.bench.shown_errors import (
    FIGURES,
    cell,
    figure_interval,
    row_name,
    seconds_text,
)


def plot_svgs(
    report: ScenarioReport, words: Strings, *, name: str, narrow: bool = False
) -> tuple[str, ...]:
    """The charts of a report as `svg` elements, with a `name` that is unique on the page."""
    size = NARROW_SIZE if narrow else WIDE_SIZE
    return tuple(filter(None, (chart_svg(chart, name, size, words) for chart in report.charts)))


_SPREAD = 20.0
"""A scale is logarithmic where its figures differ by more than this factor."""
_MAX_FIGURES = 3
"""The most figures that are drawn; all are in the table."""
_GAP = 18.0
"""Between two scales."""


def sweep_svg(sweep: SweepReport, words: Strings, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where nothing was measured."""
    figures = sweep.show[:_MAX_FIGURES]
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
        bottom = _panel(parts, sweep, figure, scale, top, names, words)
        top = bottom if narrow else top
    if any(row.own for row in sweep.rows):
        own_entry = Entry("own", words.translate("as the model is"))
        key_svg, bottom = key([own_entry], 6.0, bottom + 20, width)
        parts.append(key_svg)
    titles = {figure: words.translate(FIGURES[figure]) for figure in figures}
    title = f"{sweep.title}: {', '.join(titles.values())}"
    cells = [
        (row, [f"{titles[f]} {words.translate(cell(row, f) or row.status)}" for f in figures])
        for row in sweep.rows
    ]
    text = " ".join(f"{row.parameter} {row.value}: {', '.join(texts)}." for row, texts in cells)
    return svg("".join(parts), (width, bottom), name, (title, text))


def _panel(
    parts: list[str],
    sweep: SweepReport,
    figure: str,
    scale: Scale,
    top: float,
    names: float,
    words: Strings,
) -> float:
    """Add one figure of all rows, with their names where there is room; return its lower end."""
    y = top + 34
    ticks = scale.ticks(max(2, int((scale.end - scale.start) / 56)))
    title = shorten_to_width(words.translate(FIGURES[figure]), scale.end - scale.start + 10, SIZE)
    parts.append(label(scale.start, top + 14, title))
    groups = [list(rows) for _, rows in groupby(sweep.rows, key=lambda row: row.parameter)]
    row_parts: list[str] = []
    for number, rows in enumerate(groups):
        if names:
            head = shorten_to_width(rows[0].parameter, names - 8, TICK_SIZE)
            row_parts.append(label(2, y + 4, head, f'{FINE} font-weight="600"'))
        row_parts += _group(rows, figure, scale, y + ROW, number, names, words)
        y += ROW * (len(rows) + 1) + 4
    lines = [f"M{x:.1f} {top + 22:.1f}V{y - 10:.1f}" for x, _ in ticks]
    parts.append(path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"'))
    parts += row_parts
    look = f'text-anchor="middle" {FINE}'
    parts += [label(x, y + 4, words.translate(text), look) for x, text in ticks]
    return y + 12


def _group(
    rows: Sequence[SweepRow],
    figure: str,
    scale: Scale,
    top: float,
    number: int,
    names: float,
    words: Strings,
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
            text = "" if row.status == "ok" else words.translate(row.status)
            yield label(scale.start, y + 4, text, FINE)
            continue
        x = scale(interval.value)
        title = f"{row.parameter} {row.value}: {words.translate(cell(row, figure))}"
        yield path(bar(scale(interval.low), scale(interval.high), y), f'stroke="{colour(number)}"')
        yield symbols(number, [symbol(number, x, y, MARK, full=True, title=title)])
        if row.own:
            yield ring(x, y, 7)


def engine_svg(report: EngineScenario, words: Strings, *, name: str, narrow: bool = False) -> str:
    """The time of a step by the number of worlds; empty where nothing was timed."""
    lines = []
    for number, row in enumerate(report.rows):
        points = tuple(
            ChartPoint(
                float(cost.worlds),
                cost.seconds.value * 1e6,
                f"{row_name(row)}, {whole_number(cost.worlds)} worlds: "
                f"{seconds_text(cost.seconds.value, 3)}",
            )
            for cost in row.costs
            if cost.seconds is not None
        )
        lines += [ChartLine(row_name(row), number, points)] if points else []
    text = " ".join(
        f"{words.translate(line.name)}: "
        f"{', '.join(words.translate(point.title.rsplit(', ', 1)[1]) for point in line.points)}."
        for line in lines
    )
    chart = Chart(
        title=f"{report.title or report.name}: time of a step by the number of worlds",
        text=text,
        axes=("worlds simulated at once", "time of a step per world (µs)"),
        lines=tuple(lines),
        marks=(ChartMark("note", "lowest of at least 8 rounds"),),
    )
    return chart_svg(chart, name, NARROW_SIZE if narrow else WIDE_SIZE, words)
