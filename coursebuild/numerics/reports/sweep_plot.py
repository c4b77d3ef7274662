"""The plot of a sweep as SVG: a row for each value, and for each figure a scale beside it.

Entry point: `sweep_svg(sweep, …)`.

A dot is what was measured, a bar its interval, a line joins the values of one parameter, and a ring
is around the value that the model has. A scale is logarithmic where its figures differ by much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from coursebuild.core.drawing.marks import shorten_to_width, text_width
from coursebuild.core.drawing.scales import Scale, log
from coursebuild.numerics.reports.chart import NARROW, WIDE
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
from coursebuild.numerics.reports.sweep import (
    FIGURES,
    SweepReport,
    SweepRow,
    cell,
    interval,
    shown_figures,
)

_SPREAD = 20.0
"""By what factor figures differ where their scale is logarithmic."""
_MOST = 3
"""Figures that are drawn; all are in the table."""
_GAP = 18.0
"""Between two scales."""


def sweep_svg(sweep: SweepReport, *, name: str, narrow: bool = False) -> str:
    """The plot as an `svg` element; empty where nothing was measured.

    Args:
        sweep: what to draw.
        name: unlike those of all other plots on the page: what describes it has an id.
        narrow: for narrow screens: the scales stand below each other.
    """
    figures = shown_figures(sweep)[:_MOST]
    width, _ = NARROW if narrow else WIDE
    if not figures:
        return ""
    texts = [*(f"  {row.value}" for row in sweep.rows), *(row.parameter for row in sweep.rows)]
    left = min(0.45 * width, max(text_width(text, TICK_SIZE) for text in texts) + 16)
    beside = 1 if narrow else len(figures)
    wide = (width - left - 14 - _GAP * (beside - 1)) / beside
    parts: list[str] = []
    top = bottom = 0.0
    for n, figure in enumerate(figures):
        start = left + (n % beside) * (wide + _GAP)
        scale = _scale(sweep.rows, figure, start, start + wide)
        names = left if n % beside == 0 else 0.0
        bottom = _panel(parts, sweep, figure, scale, top, names)
        top = bottom if narrow else top
    if any(row.own for row in sweep.rows):
        below, bottom = key([Entry("own", "as the model is")], 6.0, bottom + 20, width)
        parts.append(below)
    title = f"{sweep.title}: {', '.join(FIGURES[figure] for figure in figures)}"
    return svg("".join(parts), (width, bottom), name, (title, _said(sweep, figures)))


def _scale(rows: Sequence[SweepRow], figure: str, left: float, right: float) -> Scale:
    found = [interval(row, figure) for row in rows]
    values = [x for one in found if one is not None for x in (one.low, one.high)]
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
    """One figure of all rows, with their names where there is room at the left; where it ends."""
    y = top + 34
    ticks = scale.ticks(max(2, int((scale.end - scale.start) / 56)))
    title = shorten_to_width(FIGURES[figure], scale.end - scale.start + 10, SIZE)
    parts.append(label(scale.start, top + 14, title))
    groups = [list(rows) for _, rows in groupby(sweep.rows, key=lambda row: row.parameter)]
    drawn: list[str] = []
    for number, rows in enumerate(groups):
        if names:
            head = shorten_to_width(rows[0].parameter, names - 8, TICK_SIZE)
            drawn.append(label(2, y + 4, head, f'{FINE} font-weight="600"'))
        drawn += _group(rows, figure, scale, y + ROW, number, names)
        y += ROW * (len(rows) + 1) + 4
    lines = [f"M{x:.1f} {top + 22:.1f}V{y - 10:.1f}" for x, _ in ticks]
    parts.append(path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"'))
    parts += drawn
    parts += [label(x, y + 4, text, f'text-anchor="middle" {FINE}') for x, text in ticks]
    return y + 12


def _group(
    rows: Sequence[SweepRow], figure: str, scale: Scale, top: float, number: int, names: float
) -> Iterator[str]:
    """The values of a parameter."""
    places = [(interval(row, figure), top + ROW * n) for n, row in enumerate(rows)]
    for (one, y), (other, below) in pairwise(places):
        if one is not None and other is not None:
            d = f"M{scale(one.value):.1f} {y:.1f}L{scale(other.value):.1f} {below:.1f}"
            yield path(d, line_look(number))
    for row, (found, y) in zip(rows, places, strict=True):
        if names:
            yield label(names - 8, y + 4, row.value, f'text-anchor="end" {FINE}')
        if found is None:
            text = "" if row.status == "ok" else row.status
            yield label(scale.start, y + 4, text, FINE)
            continue
        x, title = scale(found.value), f"{row.parameter} {row.value}: {cell(row, figure)}"
        yield path(bar(scale(found.low), scale(found.high), y), f'stroke="{colour(number)}"')
        yield symbols(number, [symbol(number, x, y, MARK, full=True, title=title)])
        if row.own:
            yield ring(x, y, 7)


def _said(sweep: SweepReport, figures: Sequence[str]) -> str:
    """The plot for who cannot see it."""
    return " ".join(
        f"{row.parameter} {row.value}: "
        + ", ".join(f"{FIGURES[one]} {cell(row, one) or row.status}" for one in figures)
        + "."
        for row in sweep.rows
    )
