"""A chart of lines between two logarithmic axes, as SVG.

Entry point: `chart_svg(chart, …)`.

1. A line has a colour, a mark and a dash of its own; its name stands in the key, or at its end
   where there is no key. Bars are intervals.
2. Crosses at the upper edge are lost runs.
3. A band at the bottom covers errors that the reference cannot resolve.

Colours are variables of the page's style sheet with a fallback, set as attributes, since pages
allow no inline styles. The same chart gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from msgspec import Struct

from coursebuild.core.drawing.marks import (
    markup_text,
    separate_labels,
    shorten_to_width,
    text_width,
)
from coursebuild.core.drawing.scales import Scale, log, number_text
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.strokes import (
    FINE,
    HALO,
    MARK,
    RING,
    SIZE,
    SMALL,
    TICK_SIZE,
    Entry,
    area,
    bar,
    colour,
    cross,
    key,
    label,
    line_look,
    path,
    ring,
    svg,
    symbol,
    symbols,
)

WIDE_SIZE, NARROW_SIZE, PAIR_SIZE = (620.0, 320.0), (350.0, 260.0), (430.0, 236.0)
"""The width of a chart and the height between its axes: for wide screens, for narrow ones, and for
charts beside each other."""
_TOP = 16.0
"""Space above, for lost runs."""
_NAMES = 90.0
"""Space at the right, for names at the ends of lines."""
_NAME = 15.0
"""The distance from one name to the next."""


class Point(Struct, frozen=True):
    """A run."""

    x: Interval
    y: float | None
    """`None` for a run that was lost."""
    title: str
    """The tooltip."""
    full: bool = True
    """Whether its mark is filled."""
    small: bool = False
    """Whether it stands beside the line, with a smaller mark."""
    ringed: bool = False


class Line(Struct, frozen=True):
    """Points joined in their order, except for small and lost ones."""

    name: str
    number: int
    """Selects colour, dash and mark."""
    points: tuple[Point, ...]

    @property
    def visible_points(self) -> list[Point]:
        """The points that were not lost."""
        return [point for point in self.points if point.y is not None]


class Chart(Struct, frozen=True):
    """The content of a chart."""

    title: str
    text: str
    """The description for readers who cannot see the chart."""
    axes: tuple[str, str]
    """The titles of the horizontal and the vertical axis."""
    lines: tuple[Line, ...]
    least: float = 0.0
    """Errors below are not resolved."""
    unit_label: str = ""
    """The meaning of the value 1, if it has one."""
    marks: tuple[Entry, ...] = ()
    """Entries of the key after the lines; without them there is no key."""


def chart_svg(chart: Chart, name: str, size: tuple[float, float]) -> str:
    """The chart as an `svg` element; empty where there is no point to be drawn.

    Args:
        chart: what to draw.
        name: unique among the drawings on the page, as ids are made from it.
        size: one of those above.
    """
    if not any(line.visible_points for line in chart.lines):
        return ""
    x, y = _scales(chart, size)
    body, height = "".join(_parts(chart, x, y)), y.start + 48
    if chart.marks:
        lines = (Entry("line", line.name, line.number) for line in chart.lines)
        left = 6.0 if size == NARROW_SIZE else x.start
        key_svg, height = key((*lines, *chart.marks), left, y.start + 62, size[0])
        body += key_svg
    return svg(body, (size[0], height), name, (chart.title, chart.text))


def _scales(chart: Chart, size: tuple[float, float]) -> tuple[Scale, Scale]:
    """The axes, wide enough for all that is between them."""
    points = [point for line in chart.lines for point in line.points]
    xs = [log(x) for point in points for x in (point.x.low, point.x.high)]
    ys = [log(point.y) for point in points if point.y]
    pad = max(0.06 * (max(xs) - min(xs)), 0.12)
    floor = log(chart.least)
    bottom, top = min(ys, default=floor), max(ys, default=floor + 1)
    if chart.unit_label and bottom - 1 <= 0 <= top + 1:
        bottom, top = min(bottom, 0.0), max(top, 0.0)
    if floor > bottom - 1.5:  # the band, with room for what it says
        bottom = min(bottom, floor) - 0.07 * max(top - bottom, 1.0)
    span = max(top - bottom, 0.6)
    width, height = size
    y = Scale(_TOP + height, _TOP, bottom - 0.05 * span, bottom + 1.08 * span)
    left = 32 + max((text_width(text, TICK_SIZE) for _, text in _ticks_y(y)), default=0.0)
    right = width - (10 if chart.marks else _NAMES)
    return Scale(left, right, min(xs) - pad, max(xs) + pad), y


def _parts(chart: Chart, x: Scale, y: Scale) -> Iterator[str]:
    """All parts of the drawing, the lowest layer first."""
    lines, texts = _grid(x, y, chart.axes)
    yield from _levels(chart, x, y)
    yield path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"')
    edge = f"M{x.start:.1f} {y.end:.1f}V{y.start:.1f}H{x.end:.1f}"
    yield path(edge, 'stroke="currentColor" stroke-opacity="0.7"')
    yield from texts
    for line in chart.lines:
        places = [_place(point, x, y) for point in line.visible_points if not point.small]
        if len(places) > 1:
            d = "M" + "L".join(f"{right:.1f} {down:.1f}" for right, down in places)
            yield path(d, line_look(line.number))
    for line in chart.lines:
        yield from _marks(line, x, y)
        yield from (ring(*_place(point, x, y), RING) for point in line.points if point.ringed)
    if not chart.marks:
        yield from _names(chart, x, y)


def _levels(chart: Chart, x: Scale, y: Scale) -> Iterator[str]:
    """The band that is not resolved, and the line at 1."""
    if chart.least > 0 and log(chart.least) > y.low:
        top = y(chart.least)
        d = f"M{x.start:.1f} {top:.1f}H{x.end:.1f}V{y.start:.1f}H{x.start:.1f}Z"
        yield area(d, 'fill-opacity="0.09"')
        text = f"under {number_text(chart.least)}: not resolved by the reference"
        at = (top + y.start) / 2 + 4 if y.start - top >= 16 else top - 5
        yield label(x.end - 6, at, text, f'text-anchor="end" {FINE} {HALO}')
    if chart.unit_label and y.low < 0 < y.high:
        look = 'stroke="currentColor" stroke-dasharray="1 3" stroke-width="1.2"'
        yield path(f"M{x.start:.1f} {y(1.0):.1f}H{x.end:.1f}", look)
        yield label(x.start + 6, y(1.0) - 4, chart.unit_label, f"{FINE} {HALO}")


def _place(point: Point, x: Scale, y: Scale) -> tuple[float, float]:
    """The place of a run; at the upper edge if it was lost."""
    return x(point.x.value), y.end - 6 if point.y is None else y(point.y)


def _marks(line: Line, x: Scale, y: Scale) -> Iterator[str]:
    """The runs of a line with their intervals."""
    paint, bars, marks = colour(line.number), "", []
    for point in sorted(line.points, key=lambda point: point.small):
        right, down = _place(point, x, y)
        if point.y is None:
            yield cross(right, down, paint, point.title)
            continue
        if point.x.high > point.x.low:
            bars += bar(x(point.x.low), x(point.x.high), down)
        size = SMALL if point.small else MARK
        marks.append(symbol(line.number, right, down, size, full=point.full, title=point.title))
    yield path(bars, f'stroke="{paint}"') if bars else ""
    yield symbols(line.number, marks)


def _names(chart: Chart, x: Scale, y: Scale) -> Iterator[str]:
    """The names at the right, in the order in which the lines end, without overlap."""
    lines = [line for line in chart.lines if line.visible_points]
    ends = [(_place(line.visible_points[-1], x, y), line) for line in lines]
    ends.sort(key=lambda end: end[0][1])
    places = separate_labels([down for (_, down), _ in ends], _NAME, y.end, y.start)
    for ((right, down), line), at in zip(ends, places, strict=True):
        paint = colour(line.number)
        lead = f"M{right + 5:.1f} {down:.1f}L{x.end + 6:.1f} {at:.1f}"
        yield path(lead, f'stroke="{paint}" stroke-opacity="0.5" stroke-width="0.8"')
        look = f'fill="{paint}" font-weight="600" {FINE} {HALO}'
        yield label(x.end + 9, at + 4, line.name, look)


def _grid(x: Scale, y: Scale, titles: tuple[str, str]) -> tuple[list[str], list[str]]:
    """Lines of the grid, and the texts of the axes."""
    lines = [f"M{x.start:.1f} {at:.1f}H{x.end:.1f}" for at in _decades(y)]
    texts: list[str] = []
    for at, text in _ticks_y(y):
        texts.append(label(x.start - 7, at + 4, text, f'text-anchor="end" {FINE}'))
        lines.append(f"M{x.start:.1f} {at:.1f}h-4")
    x_ticks = _ticks_x(x)
    for at in _decades(x) or [at for at, _ in x_ticks]:
        lines.append(f"M{at:.1f} {y.end:.1f}V{y.start:.1f}")
    for at, text in x_ticks:
        lines.append(f"M{at:.1f} {y.start:.1f}v5")
        texts.append(label(at, y.start + 18, text, f'text-anchor="middle" {FINE}'))
    x_title, y_title = titles
    y_title = shorten_to_width(y_title, y.start - y.end, SIZE)
    texts.append(
        f'<text transform="translate(14 {(y.start + y.end) / 2:.1f}) rotate(-90)" '
        f'text-anchor="middle">{markup_text(y_title)}</text>'
    )
    texts.append(label((x.start + x.end) / 2, y.start + 37, x_title, 'text-anchor="middle"'))
    return lines, texts


def _decades(scale: Scale) -> list[float]:
    """The place of each power of ten, unless they are too many to be told apart."""
    first, last = math.ceil(scale.low - 1e-9), math.floor(scale.high + 1e-9)
    return [scale(10.0**n) for n in range(first, last + 1)] if last - first <= 24 else []


def _ticks_y(y: Scale) -> list[tuple[float, str]]:
    return y.ticks(max(2, int((y.start - y.end) / 30)))


def _ticks_x(x: Scale) -> list[tuple[float, str]]:
    """As many ticks as fit without their texts touching."""
    for most in (9, 7, 5, 4, 3, 2):
        ticks = x.ticks(most)
        ticks_with_widths = [(at, text_width(text, TICK_SIZE)) for at, text in ticks]
        if all(b - a >= (w + v) / 2 + 8 for (a, w), (b, v) in pairwise(ticks_with_widths)):
            return ticks
    return ticks[:1]
