"""The result table of a sweep: a model with one of its parameters at other values.

Entry points: `SweepReport`; `shown_figures(sweep)`, `cell(row, figure)`, `figure_interval` and
`FIGURES`.
"""

from __future__ import annotations

from coursebuild.core.drawing.scales import tick_texts
from coursebuild.numerics.reports import Interval, Record

FIGURES = {
    "change": "change (1: just visible)",
    "figure": "change of what is measured",
    "penetration": "depth (m)",
    "slip": "slip (m)",
    "restitution": "restitution",
    "residual": "solver residual",
    "iterations": "iterations a step",
    "cost": "cost",
    "throughput": "× real time",
}
"""The figures that are measured for every value, with their labels."""


class SweepRow(Record, frozen=True):
    """The model with one parameter at one value."""

    parameter: str
    """As the course names it, such as `geom.solref[0]`; `threads` is that of a rollout."""
    value: str
    own: bool
    """Whether it is the value that the model has."""
    status: str
    """`ok`, `slow-growth`, `diverged` or `reset`, as of a setting."""
    reasons: tuple[str, ...] = ()
    change: float | None = None
    """How far the motion is from that of the model as it is, in a picture: 1 is just visible."""
    figure: float | None = None
    """The same of what the scenario declares to be measured, in its unit."""
    penetration: float | None = None
    """Deepest contact, m."""
    slip: float | None = None
    """The longest way that two geoms slide on each other, m."""
    restitution: float | None = None
    """Of the hardest hit: speed apart over speed together, along the normal; 0 for what stays."""
    residual: float | None = None
    """Of the solver: the largest difference of forces, constraint or applied, between forward and
    inverse dynamics, relative to the largest constraint force."""
    iterations: float | None = None
    """Of the solver, mean of all steps."""
    cost: Interval | None = None
    """Time for the scenario, relative to the model as it is."""
    throughput: Interval | None = None
    """Simulated time over wall time, of all that a rollout simulates at once."""


class SweepReport(Record, frozen=True):
    """All rows of a sweep."""

    name: str
    title: str
    scenario: str
    show: tuple[str, ...]
    """The figures to show; empty: those that differ."""
    rows: tuple[SweepRow, ...]


def shown_figures(sweep: SweepReport) -> tuple[str, ...]:
    """The figures that a reader is shown."""
    if sweep.show:
        return sweep.show
    intervals = {name: [figure_interval(row, name) for row in sweep.rows] for name in FIGURES}
    values = {
        name: [interval.value for interval in row if interval] for name, row in intervals.items()
    }
    return tuple(name for name, row in values.items() if row and max(row) > 1.01 * min(row))


def figure_interval(row: SweepRow, figure: str) -> Interval | None:
    """A figure of a row; an interval without width where repeated runs give the same."""
    value: float | Interval | None = getattr(row, figure)
    return Interval(value, value, value) if isinstance(value, float) else value


def cell(row: SweepRow, figure: str) -> str:
    """A figure in three digits; with half its interval in per cent, where it has one."""
    interval = figure_interval(row, figure)
    if interval is None:
        return ""
    text = tick_texts([float(f"{interval.value:.3g}")])[0]
    return f"{text} ± {100 * interval.half_width:.2g} %" if interval.high > interval.low else text
