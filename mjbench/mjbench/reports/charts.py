"""Charts of lines between two logarithmic axes, as values for any program, and in letters."""

from __future__ import annotations

import math
from collections.abc import Iterator

from mjbench.reports import Interval, Record


class ChartPoint(Record, frozen=True, omit_defaults=True):
    """A run."""

    x: float
    y: float | None
    """`None` for a run that was lost."""
    title: str
    """What the run was, in words."""
    spread: tuple[float, float] | None = None
    """The interval in which `x` lies; `None` where it is exact."""
    full: bool = True
    """Whether it is on the front."""
    small: bool = False
    """Whether it stands beside the line."""
    ringed: bool = False
    """Whether it is the scene's own setting."""


def chart_point(x: Interval, y: float | None, title: str, **looks: bool) -> ChartPoint:
    """A run whose work is known to an interval."""
    spread = (x.low, x.high) if x.high > x.low else None
    return ChartPoint(x.value, y, title, spread, **looks)


class ChartLine(Record, frozen=True):
    """Points joined in their order, except for small and lost ones."""

    name: str
    number: int
    """Selects colour, dash and mark."""
    points: tuple[ChartPoint, ...]


class ChartLevel(Record, frozen=True):
    """A level of the vertical axis that means something."""

    y: float
    text: str


class ChartMark(Record, frozen=True):
    """An entry of the key after the lines."""

    kind: str
    """`front`, `beaten`, `other`, `own` or `lost`."""
    text: str


class Chart(Record, frozen=True):
    """The content of a chart."""

    title: str
    text: str
    """The description for readers who cannot see the chart."""
    axes: tuple[str, str]
    """The titles of the horizontal and the vertical axis."""
    lines: tuple[ChartLine, ...]
    least: float = 0.0
    """Errors below are not resolved."""
    levels: tuple[ChartLevel, ...] = ()
    marks: tuple[ChartMark, ...] = ()
    """Without them there is no key."""


ON_FRONT = "whatever is cheaper errs more"
"""What is said of a run on the front."""

_LETTERS = "EIFRDABCGHJKLMNOPQSTUVWXYZ"
"""Of lines, by their number: Euler, implicit, implicitfast, RK4, discrete, and others."""
_WIDTH, _HEIGHT = 60, 14
_OWN, _LOST = "@", "x"


def plot_lines(chart: Chart, width: int = 80) -> Iterator[str]:
    """The chart: work across, error up, both logarithmic; nothing where no run has an error."""
    places = [(line.number, point) for line in chart.lines for point in line.points if point.x > 0]
    errors = [math.log10(point.y) for _, point in places if point.y]
    if not errors:
        return
    levels = [level for level in chart.levels if level.y > 0]
    heights = [math.log10(level.y) for level in levels]
    near = [y for y in heights if min(errors) - 1 <= y <= max(errors) + 1]
    columns = min(_WIDTH, width - 12)
    x = Axis([math.log10(point.x) for _, point in places], columns - 1)
    y = Axis([*errors, *near], _HEIGHT - 1)
    rows = [[" "] * columns for _ in range(_HEIGHT)]
    for level in near:
        rows[round(y.at(level))] = ["·"] * columns
    for number, point in sorted(places, key=lambda place: (place[1].ringed, place[1].full)):
        row = _HEIGHT - 1 if not point.y else round(y.at(math.log10(point.y)))
        letter = _LETTERS[number % len(_LETTERS)]
        mark = _LOST if point.y is None else letter if point.full else letter.lower()
        rows[row][round(x.at(math.log10(point.x)))] = _OWN if point.ringed else mark
    yield f"{chart.axes[1]}"
    ticks = {round(at): text for at, text in y.ticks()}
    for number in reversed(range(_HEIGHT)):
        yield f"{ticks.get(number, ''):>9} │{''.join(rows[number])}".rstrip()
    yield f"{'':>9} └{'─' * columns}"
    axis = [" "] * (columns + 8)
    for at, text in x.ticks():
        axis[round(at) : round(at) + len(text)] = text
    yield f"{'':>11}{''.join(axis)}".rstrip()
    yield f"{'':>11}{chart.axes[0]}"
    names = [f"{_LETTERS[line.number % len(_LETTERS)]} {line.name}" for line in chart.lines]
    points = [point for _, point in places]
    keys = [f"{_OWN} the model's own"] * any(point.ringed for point in points)
    keys += [f"{_LOST} lost"] * any(point.y is None for point in points)
    keys += [f"capital: {ON_FRONT}"] * (not all(point.full for point in points))
    yield "  ".join([*names, *keys])
    texts = [level.text for level, at in zip(levels, heights, strict=True) if at in near]
    if texts:
        yield f"dotted: {', '.join(texts)}"


class Axis:
    """A logarithmic axis: places of decimal logarithms, from 0 to its length."""

    def __init__(self, values: list[float], length: float, margin: float = 0.0) -> None:
        self.low = min(values) - margin
        self.span = max(max(values) + margin - self.low, 0.3)
        self.length = length

    def at(self, value: float) -> float:
        """The place of a logarithm."""
        return (value - self.low) / self.span * self.length

    def ticks(self) -> list[tuple[float, str]]:
        """Places and texts of powers of ten, or where there are none, of both ends."""
        first, last = math.ceil(self.low - 1e-9), math.floor(self.low + self.span + 1e-9)
        if last - first >= 1:
            powers = range(first, last + 1, 1 + (last - first) // 6)
            return [(self.at(n), f"{10.0**n:g}") for n in powers]
        ends = (self.low, self.low + self.span)
        return [(self.at(end), f"{10.0**end:.2g}") for end in ends]
