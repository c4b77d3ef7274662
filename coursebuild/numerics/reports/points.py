"""What of a scenario's report is drawn: which point stands for which row, and where.

Entry points: `chart(report, quantity)`, `quantities(report)`, `setting_text`, `status_text`
and other words; `described`, the plot for who cannot see it.

1. One line stands for an integrator, over those rows that have the scene's own solver, iterations
   and cone; the rows with others are points beside it.
2. A row that was not timed is put where its number of steps says: time goes by steps.
3. Where nothing at all was timed, the number of steps stands in for the cost.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import (
    FLOORS,
    MeasuredSetting,
    ScenarioReport,
    WorkPrecisionRow,
)

KNOWN = ("Euler", "implicit", "implicitfast", "RK4", "discrete")
"""Integrators in the order in which they are told, and keep their colour and mark."""
FEWEST_STEPS = 20
"""Steps of a scenario at the longest timestep of which it is tried whether it is stable."""


class Quantity(Struct, frozen=True):
    """An error that can be drawn."""

    name: str
    """The field of a row: `figure`, `seen`, `position`, `attitude` or `velocity`."""
    label: str
    """What it is, with its unit."""
    floor: float
    """What the reference may be wrong by in it; 0 where that is not said."""

    @property
    def least(self) -> float:
        """No error below this is given."""
        return FLOORS * self.floor

    def of(self, row: WorkPrecisionRow) -> float | None:
        """The largest over the horizon; `None` where the row has none."""
        found: tuple[float, float] | float | None = getattr(row, self.name)
        value = found[0] if isinstance(found, tuple) else found
        return None if value is None or not math.isfinite(value) else value


class Point(Struct, frozen=True):
    """A row that is drawn."""

    row: int
    cost: Interval
    """Relative to the scene's own setting, or steps where nothing was timed."""
    error: float | None
    """`None` for a run that was lost."""


class PlotLine(Struct, frozen=True):
    """What is drawn of an integrator."""

    integrator: str
    number: int
    """Which colour, dash and mark."""
    points: tuple[Point, ...]
    """Joined by a line, by timestep."""
    others: tuple[Point, ...]
    """With another solver, iterations or cone."""
    lost: tuple[Point, ...]
    """Runs without an error to show: diverged, reset, or grown."""


class Chart(Struct, frozen=True):
    """What is drawn of a scenario."""

    quantity: Quantity
    lines: tuple[PlotLine, ...]
    timed: bool
    """Whether any cost was measured."""


def quantities(report: ScenarioReport) -> tuple[Quantity, ...]:
    """The errors that some row has, what the scenario declares to be measured first."""
    known = (
        Quantity("figure", report.figure or "figure", 0.0),
        Quantity("seen", "what is seen (1: just visible)", 0.0),
        Quantity("position", "position (m or rad)", report.floor),
        Quantity("attitude", "attitude (rad)", report.floor),
        Quantity("velocity", "velocity (m/s or rad/s)", report.velocity_floor),
    )
    return tuple(one for one in known if any(one.of(row) is not None for row in report.rows))


def telling(report: ScenarioReport) -> Quantity | None:
    """The error to show where only one is: that of the front, else the first beyond its floor.

    `None` where there is none at all.
    """
    found = quantities(report)
    for one in found:
        least = one.least * (1 + 1e-9)
        if any((error := one.of(row)) is not None and error > least for row in report.rows):
            return one
    return found[0] if found else None


def chart(report: ScenarioReport, quantity: Quantity) -> Chart:
    """What to draw of an error."""
    rows = report.rows
    timed = [row for row in rows if row.cost is not None and row.cost.value > 0]
    usual = usual_setting(rows)
    kind = None if usual is None else _kind(usual)
    names = sorted({row.setting.integrator for row in rows}, key=integrator_rank)
    others = [name for name in names if name not in KNOWN]
    lines = []
    for name in names:
        shown = [
            Point(n, _cost(row, timed), quantity.of(row) if row.status == "ok" else None)
            for n, row in enumerate(rows)
            if row.setting.integrator == name
        ]
        kept = [one for one in shown if one.error is not None]
        line = [one for one in kept if _kind(rows[one.row].setting) == kind]
        number = KNOWN.index(name) if name in KNOWN else len(KNOWN) + others.index(name)
        lines.append(
            PlotLine(
                name,
                number,
                tuple(sorted(line, key=lambda one: -rows[one.row].setting.timestep)),
                tuple(one for one in kept if one not in line),
                tuple(one for one in shown if one.error is None),
            )
        )
    return Chart(quantity, tuple(lines), bool(timed))


def _cost(row: WorkPrecisionRow, timed: Sequence[WorkPrecisionRow]) -> Interval:
    """What a row costs; of one that was not timed, what its number of steps says."""
    if row in timed and row.cost is not None:
        return row.cost
    like = [one for one in timed if one.setting.integrator == row.setting.integrator] or timed
    rates = [one.cost.value / max(one.steps, 1) for one in like if one.cost is not None]
    value = max(row.steps, 1) * (statistics.median(rates) if rates else 1.0)
    return Interval(value, value, value)


def is_cut_short(report: ScenarioReport) -> bool:
    """Whether it is the duration that ended the search for stable timesteps."""
    longest = report.duration / FEWEST_STEPS
    return any(math.isclose(one.searched[1], longest, rel_tol=1e-9) for one in report.stable)


def integrator_rank(name: str) -> tuple[int, str]:
    """By which integrators are told: those of MuJoCo in their order, then others by name."""
    return (KNOWN.index(name) if name in KNOWN else len(KNOWN), name)


def _kind(setting: MeasuredSetting) -> tuple[str, int, str]:
    """All of a setting but integrator and timestep."""
    return setting.solver, setting.iterations, setting.cone


def usual_setting(rows: Sequence[WorkPrecisionRow]) -> MeasuredSetting | None:
    """One with the solver, iterations and cone of the scene itself; of most rows where it has none.

    `None` where there are no rows.
    """
    for row in rows:
        if row.own:
            return row.setting
    counted = Counter(_kind(row.setting) for row in rows)
    most = max(sorted(counted), key=counted.__getitem__, default=None)
    return next((row.setting for row in rows if _kind(row.setting) == most), None)


def seconds_text(value: float, digits: int = 6) -> str:
    """A short time with its unit."""
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if value >= size * 0.9999995:
            return f"{value / size:.{digits}g} {unit}"
    return f"{value:.{digits}g} s"


def interval_text(value: Interval) -> str:
    """A figure in three digits with half the width of its interval, in per cent."""
    share = 100 * value.half_width
    return f"{value.value:.3g}" + (f" ± {share:.2g} %" if 0.05 <= share < math.inf else "")


def setting_text(setting: MeasuredSetting, like: MeasuredSetting | None = None) -> str:
    """A setting in words; solver, iterations and cone only where they differ from those of `like`.

    All that there is where nothing is given.
    """
    parts = [f"{setting.integrator} at {seconds_text(setting.timestep)}"]
    return ", ".join([*parts, *solving_parts(setting, like)])


def solving_parts(setting: MeasuredSetting, like: MeasuredSetting | None = None) -> list[str]:
    """Solver, iterations and cone of a setting in words; see `setting_text`."""
    parts = []
    if setting.solver and (like is None or setting.solver != like.solver):
        parts.append(setting.solver)
    if setting.iterations and (like is None or setting.iterations != like.iterations):
        many = "iteration" if setting.iterations == 1 else "iterations"
        parts.append(f"{setting.iterations} {many}")
    if setting.cone and (like is None or setting.cone != like.cone):
        parts.append(f"{setting.cone} cone")
    return parts


_STATUS = {
    "ok": "ok",
    "slow-growth": "grew",
    "diverged": "diverged",
    "reset": "reset",
}


def status_text(status: str) -> str:
    """How a run went, in words."""
    return _STATUS.get(status, status)


# --------------------------------------------------------------------------- the plot in words


def described(report: ScenarioReport, found: Chart) -> tuple[str, str]:
    """The title of the plot, and what is to be seen in it."""
    label = found.quantity.label
    against = "cost" if found.timed else "steps"
    title = f"{report.title or report.name}: error of {label} against {against}"
    parts = [_range(line) for line in found.lines if line.points or line.others]
    lost = [line.integrator for line in found.lines if line.lost]
    parts += [f"Runs were lost under {', '.join(lost)}."] if lost else []
    own = next((n for n, row in enumerate(report.rows) if row.own), None)
    if own is not None:
        parts.append(f"The scene’s own setting is {setting_text(report.rows[own].setting)}.")
    if report.verdict.text:
        parts.append(report.verdict.text)
    if found.quantity.floor > 0:
        parts.append(f"No error below {found.quantity.least:.1e} is given.")
    return title, " ".join(parts)


def _range(line: PlotLine) -> str:
    points = [*line.points, *line.others]
    errors = [p.error for p in points if p.error is not None]
    costs = [p.cost.value for p in points]
    spread = f"{min(errors):.2g}"
    if max(errors) > min(errors):
        spread = f"{max(errors):.2g} to {spread}"
    cost = f"{min(costs):.3g}"
    if max(costs) > min(costs):
        cost = f"{cost} to {max(costs):.3g}"
    return f"{line.integrator}: errors {spread} at costs of {cost}."


def point_title(report: ScenarioReport, found: Chart, point: Point) -> str:
    """What a point says when it is pointed at."""
    row = report.rows[point.row]
    parts = [setting_text(row.setting)]
    if point.error is None:
        parts.append("; ".join((status_text(row.status), *row.reasons)))
    else:
        parts.append(f"error {point.error:.3g}")
    if row.cost is not None:
        parts.append(f"cost {interval_text(row.cost)}")
    elif found.timed:
        parts.append("not timed")
    parts.append(f"{row.steps} steps")
    if row.own:
        parts.append("the scene’s own setting")
    if row.front:
        parts.append("on the Pareto front")
    elif row.dominated_by is not None and 0 <= row.dominated_by < len(report.rows):
        better = setting_text(report.rows[row.dominated_by].setting, row.setting)
        parts.append(f"{better} is better")
    return " · ".join(parts)
