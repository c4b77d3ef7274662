"""Charts of lines between two logarithmic axes, as values that any program can draw."""

from __future__ import annotations

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
