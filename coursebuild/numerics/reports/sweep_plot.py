"""The plot of a sweep as SVG: a row for each value, and for each figure a scale beside it.

Entry point: `sweep_svg(sweep, …)`.

A dot is a figure, a bar its interval; a line joins the values of one parameter, and a ring marks
the model's own value. A scale is logarithmic where its figures differ by much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from coursebuild.core.drawing.marks import shorten_to_width, text_width
from coursebuild.core.drawing.scales import Scale, log
from coursebuild.numerics.reports.chart import NARROW_SIZE, WIDE_SIZE
from coursebuild.numerics.reports.scene_report import (
    FIGURES,
    SweepReport,
    SweepRow,
    cell,
    figure_interval,
    shown_figures,
)
from coursebuild.numerics.reports.strokes import (
    FINE,
    MARK,
    ROW,
    SIZE,
    TICK_SIZE,
    Entry,
    bar,
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
    return svg("".join(parts), (width, bottom), name, (title, _describe(sweep, figures)))


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
    """The values of a parameter."""
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


def _describe(sweep: SweepReport, figures: Sequence[str]) -> str:
    """Describe the plot for readers who cannot see it."""
    return " ".join(
        f"{row.parameter} {row.value}: "
        + ", ".join(f"{FIGURES[figure]} {cell(row, figure) or row.status}" for figure in figures)
        + "."
        for row in sweep.rows
    )
