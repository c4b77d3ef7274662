"""A chart of lines between two logarithmic axes as SVG, and the primitives of all charts.

1. A line has a colour, a mark and a dash of its own; its name stands in the key, or at its end
   where there is no key. Bars are intervals, crosses at the upper edge lost runs.
2. A band at the bottom covers errors that the reference cannot resolve.

Colours are variables of the page's style sheet with a fallback, set as attributes, since pages
allow no inline styles. The same chart gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple

from msgspec.structs import replace

from coursebuild.core.drawing.scales import (
    Scale,
    log,
    markup_text,
    number_text,
    separate_labels,
    shorten_to_width,
    text_width,
)
from coursebuild.core.model.measurements import Chart, ChartPoint
from coursebuild.core.pages.renderer import Strings

_DASHES = ("", "7 3", "2 3", "10 3 2 3", "1 4", "5 2 1 2 1 2", "12 4", "6 6")
"""One more than colours, as are the marks, so that the eighth line is not the first again."""
_LIGHT = ("#0072b2", "#b34d00", "#00795a", "#a8467f", "#7a6a00", "#5b3fb0", "#1e1e1c")
"""Okabe and Ito's, darker on paper; of their two blues one is violet."""
_MARK_CORNERS = (0, 4, 4, 3, 3, 5, 6, 3)
_MARK_ANGLES = (0.0, 45.0, 0.0, -90.0, 90.0, -90.0, 0.0, 0.0)
SIZE, TICK_SIZE = 12.0, 11.0
"""Of letters, in the units of the drawing."""
MARK, SMALL = 4.2, 2.9
RING = 8.5
ROW = 18.0
"""From one line of a key to the next."""
OWN_COLOUR = "var(--rust, #86340c)"
INK = "var(--ink, currentColor)"
PAPER = "var(--paper, Canvas)"
FINE = 'font-size="11"'
"""Of texts other than names and titles."""
HALO = f'stroke="{PAPER}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
"""The paper around letters, so that lines below do not cross them."""
_FONT = "var(--sans, system-ui, sans-serif)"


class Entry(NamedTuple):
    """An entry of the key: the meaning of a mark or a line."""

    kind: str
    """`line`, `front`, `beaten`, `other`, `own` or `lost`; `note`, which has no mark."""
    text: str
    number: int | None = None
    """The number of a line."""


def path(d: str, look: str) -> str:
    """A line without filling."""
    return f'<path d="{d}" fill="none" {look}/>'


def area(d: str, look: str) -> str:
    """A filled area."""
    return f'<path d="{d}" {look}/>'


def label(x: float, y: float, text: str, look: str = "") -> str:
    """A text at a place."""
    return f'<text x="{x:.1f}" y="{y:.1f}"{look and f" {look}"}>{markup_text(text)}</text>'


def colour(number: int) -> str:
    """The colour of a line; the page may have its own."""
    n = number % len(_LIGHT)
    return f"var(--trace-{n + 1}, {_LIGHT[n]})"


def line_look(number: int) -> str:
    """The colour, width and dashes of a line."""
    dash = _DASHES[number % len(_DASHES)]
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    return f'stroke="{colour(number)}" stroke-width="1.7" stroke-linejoin="round"{dashes}'


def outline(number: int, x: float, y: float, size: float) -> str:
    """The path of a mark: circle, square, diamond, pentagon, hexagon, or one of three triangles.

    All of about the same area; `size` is the radius of the circle.
    """
    n = number % len(_MARK_CORNERS)
    corners = _MARK_CORNERS[n]
    if not corners:
        r = f"{size:g} {size:g} 0 1 0"
        return f"M{x - size:.1f} {y:.1f}a{r} {2 * size:g} 0a{r} {-2 * size:g} 0Z"
    radius = size * math.sqrt(2 * math.pi / (corners * math.sin(2 * math.pi / corners)))
    angles = [math.radians(_MARK_ANGLES[n] + 360 * k / corners) for k in range(corners)]
    places = (f"{x + radius * math.cos(a):.1f} {y + radius * math.sin(a):.1f}" for a in angles)
    return "M" + "L".join(places) + "Z"


def cross(x: float, y: float, paint: str, title: str = "") -> str:
    """The mark of a lost run."""
    s = 3.6
    d = f"M{x - s:.1f} {y - s:.1f}l{2 * s:g} {2 * s:g}m0 {-2 * s:g}l{-2 * s:g} {2 * s:g}"
    return f'<path d="{d}" fill="none" stroke="{paint}" stroke-width="1.8">{_title(title)}</path>'


def symbols(number: int, marks: Iterable[str]) -> str:
    """Marks of a line, in its colour."""
    paint = colour(number)
    return f'<g fill="{paint}" stroke="{paint}" stroke-width="1.5">{"".join(marks)}</g>'


def symbol(number: int, x: float, y: float, size: float, *, full: bool, title: str = "") -> str:
    """The mark of a run, among `symbols`; `full` where it is on the front."""
    look = "" if full else f' fill="{PAPER}"'
    return f'<path d="{outline(number, x, y, size)}"{look}>{_title(title)}</path>'


def _title(text: str) -> str:
    return f"<title>{markup_text(text)}</title>" if text else ""


def bar(low: float, high: float, y: float) -> str:
    """The path of an interval, with an end at each side."""
    return f"M{low:.1f} {y:.1f}H{high:.1f}M{low:.1f} {y - 3:.1f}v6M{high:.1f} {y - 3:.1f}v6"


def ring(x: float, y: float, radius: float) -> str:
    """The ring around the scene's own setting."""
    look = f'fill="none" stroke="{OWN_COLOUR}" stroke-width="1.8"'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" {look}/>'


def key(entries: Iterable[Entry], left: float, top: float, width: float) -> tuple[str, float]:
    """The key, in rows, and the place where it ends."""
    parts: list[str] = []
    x, y = left, top
    for entry in entries:
        text = shorten_to_width(entry.text, width - left - 40, TICK_SIZE)
        entry_width = 30 + text_width(text, TICK_SIZE) + 10
        if x > left and x + entry_width > width:
            x, y = left, y + ROW
        middle, level = x + 14, y - 4
        if entry.number is not None:
            parts.append(path(f"M{middle - 13:.1f} {level:.1f}h26", line_look(entry.number)))
            mark = symbol(entry.number, middle, level, MARK, full=True)
            parts.append(symbols(entry.number, [mark]))
        elif entry.kind == "own":
            parts.append(ring(middle, level, 6))
        elif entry.kind == "lost":
            parts.append(cross(middle, level, INK))
        elif entry.kind != "note":
            full = INK if entry.kind == "front" else PAPER
            look = f'fill="{full}" stroke="{INK}" stroke-width="1.5"'
            d = outline(0, middle, level, SMALL if entry.kind == "other" else MARK)
            parts.append(area(d, look))
        parts.append(label(x + 30, y, text, FINE))
        x += entry_width
    return "".join(parts), y + 6


def svg(body: str, size: tuple[float, float], name: str, texts: tuple[str, str]) -> str:
    """A drawing as an element; `texts`: its title, and its description for screen readers."""
    key = markup_text(name.replace("/", "-"))  # a name in XML has no slash
    title, text = map(markup_text, texts)
    return (
        f'<svg class="work-precision" viewBox="0 0 {size[0]:g} {size[1]:g}" '
        f'role="img" aria-labelledby="{key}-title {key}-text" fill="currentColor" '
        f'font-size="{SIZE:g}" font-family="{_FONT}"><title id="{key}-title">{title}'
        f'</title><desc id="{key}-text">{text}</desc>{body}</svg>'
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


def translate_chart(chart: Chart, translate: Callable[[str], str]) -> Chart:
    """The chart with its words in the language of a page."""
    x, y = map(translate, chart.axes)
    return replace(
        chart,
        title=translate(chart.title),
        text=translate(chart.text),
        axes=(x, y),
        lines=tuple(
            replace(
                line,
                name=translate(line.name),
                points=tuple(replace(p, title=translate(p.title)) for p in line.points),
            )
            for line in chart.lines
        ),
        levels=tuple(replace(level, text=translate(level.text)) for level in chart.levels),
        marks=tuple(replace(mark, text=translate(mark.text)) for mark in chart.marks),
    )


def chart_svg(chart: Chart, name: str, size: tuple[float, float], words: Strings) -> str:
    """The chart as an `svg` element; empty where there is no point to be drawn.

    `name` is unique among the drawings on the page, as ids are made from it.
    """
    if not any(line.visible_points for line in chart.lines):
        return ""
    chart = translate_chart(chart, words.translate)
    points = [point for line in chart.lines for point in line.points]
    xs = [log(x) for point in points for x in point.ends]
    ys = [log(point.y) for point in points if point.y]
    pad = max(0.06 * (max(xs) - min(xs)), 0.12)
    floor = log(chart.least)
    bottom, top = min(ys, default=floor), max(ys, default=floor + 1)
    for level in (log(level.y) for level in chart.levels if level.y > 0):
        if bottom - 1 <= level <= top + 1:
            bottom, top = min(bottom, level), max(top, level)
    if floor > bottom - 1.5:  # the band, with room for what it says
        bottom = min(bottom, floor) - 0.07 * max(top - bottom, 1.0)
    span = max(top - bottom, 0.6)
    y = Scale(_TOP + size[1], _TOP, bottom - 0.05 * span, bottom + 1.08 * span)
    left = 32 + max((text_width(text, TICK_SIZE) for _, text in _ticks_y(y)), default=0.0)
    right = size[0] - (10 if chart.marks else _NAMES)
    x = Scale(left, right, min(xs) - pad, max(xs) + pad)
    body, height = "".join(_parts(chart, x, y, words)), y.start + 48
    if chart.marks:
        lines = (Entry("line", line.name, line.number) for line in chart.lines)
        key_left = 6.0 if size == NARROW_SIZE else x.start
        marks = (Entry(mark.kind, mark.text) for mark in chart.marks)
        key_svg, height = key((*lines, *marks), key_left, y.start + 62, size[0])
        body += key_svg
    return svg(body, (size[0], height), name, (chart.title, chart.text))


def _parts(chart: Chart, x: Scale, y: Scale, words: Strings) -> Iterator[str]:
    lines, texts = _grid(x, y, chart.axes, words)
    yield from _levels(chart, x, y, words)
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
        paint, bars, marks = colour(line.number), "", []
        for point in sorted(line.points, key=lambda point: point.small):
            right, down = _place(point, x, y)
            if point.y is None:
                yield cross(right, down, paint, point.title)
                continue
            if point.spread is not None:
                low, high = point.spread
                bars += bar(x(low), x(high), down)
            size = SMALL if point.small else MARK
            marks.append(symbol(line.number, right, down, size, full=point.full, title=point.title))
        yield path(bars, f'stroke="{paint}"') if bars else ""
        yield symbols(line.number, marks)
        yield from (ring(*_place(point, x, y), RING) for point in line.points if point.ringed)
    if chart.marks:  # a key has the names
        return
    visible_lines = [line for line in chart.lines if line.visible_points]
    ends = [(_place(line.visible_points[-1], x, y), line) for line in visible_lines]
    ends.sort(key=lambda end: end[0][1])
    heights = separate_labels([down for (_, down), _ in ends], _NAME, y.end, y.start)
    for ((right, down), line), at in zip(ends, heights, strict=True):
        paint = colour(line.number)
        lead = f"M{right + 5:.1f} {down:.1f}L{x.end + 6:.1f} {at:.1f}"
        yield path(lead, f'stroke="{paint}" stroke-opacity="0.5" stroke-width="0.8"')
        look = f'fill="{paint}" font-weight="600" {FINE} {HALO}'
        yield label(x.end + 9, at + 4, line.name, look)


def _levels(chart: Chart, x: Scale, y: Scale, words: Strings) -> Iterator[str]:
    """The band that is not resolved, or where it would be, and lines of what means something."""
    if chart.least > 0 and log(chart.least) > y.low:
        top = y(chart.least)
        d = f"M{x.start:.1f} {top:.1f}H{x.end:.1f}V{y.start:.1f}H{x.start:.1f}Z"
        yield area(d, 'fill-opacity="0.09"')
        text = words.translate(f"under {number_text(chart.least)}: not resolved by the reference")
        at = (top + y.start) / 2 + 4 if y.start - top >= 16 else top - 5
        yield label(x.end - 6, at, text, f'text-anchor="end" {FINE} {HALO}')
    elif chart.least > 0:
        text = words.translate(f"not resolved: under {number_text(chart.least)}, below this scale")
        place = _roomiest(chart, x, y, text, (y.start - 5, y.end + 12))
        yield label(*place, text, f'text-anchor="middle" {FINE} {HALO}')
    for level in chart.levels:
        if level.y > 0 and y.low < log(level.y) < y.high:
            look = 'stroke="currentColor" stroke-dasharray="1 3" stroke-width="1.2"'
            yield path(f"M{x.start:.1f} {y(level.y):.1f}H{x.end:.1f}", look)
            place = _roomiest(chart, x, y, level.text, (y(level.y) - 4,))
            yield label(*place, level.text, f'text-anchor="middle" {FINE} {HALO}')


def _roomiest(
    chart: Chart, x: Scale, y: Scale, text: str, heights: Iterable[float]
) -> tuple[float, float]:
    """The middle of a text, at either side and one of the heights, furthest from all runs."""
    half = text_width(text, TICK_SIZE) / 2
    runs = [_place(point, x, y) for line in chart.lines for point in line.points]

    def room(place: tuple[float, float]) -> float:
        gaps = [
            max(abs(px - place[0]) / (half + RING), abs(py - place[1]) / SIZE) for px, py in runs
        ]
        return min(gaps, default=0.0)

    sides = (x.start + 6 + half, x.end - 6 - half)
    return max(((side, at) for at in heights for side in sides), key=room)


def _place(point: ChartPoint, x: Scale, y: Scale) -> tuple[float, float]:
    return x(point.x), y.end - 6 if point.y is None else y(point.y)


def _grid(
    x: Scale, y: Scale, titles: tuple[str, str], words: Strings
) -> tuple[list[str], list[str]]:
    lines = [f"M{x.start:.1f} {at:.1f}H{x.end:.1f}" for at in _decades(y)]
    texts: list[str] = []
    for at, text in _ticks_y(y):
        texts.append(label(x.start - 7, at + 4, words.translate(text), f'text-anchor="end" {FINE}'))
        lines.append(f"M{x.start:.1f} {at:.1f}h-4")
    for most in (9, 7, 5, 4, 3, 2):  # as many as fit without their texts touching
        x_ticks = [(at, words.translate(text)) for at, text in x.ticks(most)]
        ends = [(at, text_width(text, TICK_SIZE) / 2) for at, text in x_ticks]
        if all(b - a >= w + v + 8 for (a, w), (b, v) in pairwise(ends)):
            break
    else:
        x_ticks = x_ticks[:1]
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
