"""Which errors and figures of reports are shown, which settings are worth it, and texts of both."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.drawing.scales import tick_texts
from coursebuild.core.model.measurements import (
    FLOORS,
    EngineRow,
    Interval,
    MeasuredRun,
    MeasuredSetting,
    ScenarioReport,
    StableRow,
    SweepReport,
    SweepRow,
    WorkPrecisionRow,
)

INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4", "discrete")
"""Integrators in the order in which they are shown, which also sets their colour and mark."""
EVALUATION_LABEL = "evaluations of the forward dynamics"
FEWEST_STEPS = 20
"""Steps of a scenario at the longest timestep that is tried for stability."""


class Quantity(Struct, frozen=True):
    """An error that can be drawn."""

    name: str
    """The field of a row: `figure`, `seen`, `position`, `attitude` or `velocity`."""
    label: str
    """What it is, with its unit."""
    least: float = 0.0
    """The floor of the reference: smaller errors mean nothing."""

    def value_of(self, row: MeasuredRun) -> float | None:
        """The largest error of a row over the horizon; `None` where the row has none."""
        error: tuple[float, float] | float | None = getattr(row, self.name)
        value = error[0] if isinstance(error, tuple) else error
        return None if value is None or not math.isfinite(value) else abs(value)

    def is_resolved(self, rows: Iterable[MeasuredRun]) -> bool:
        """Whether any of the rows has an error above the floor."""
        errors = (self.value_of(row) for row in rows)
        return any(error is not None and error > self.least * (1 + 1e-9) for error in errors)


def quantities(report: ScenarioReport) -> tuple[Quantity, ...]:
    """The errors that some row has, what the scenario declares to be measured first."""
    candidates = (
        Quantity("figure", report.figure or "figure", report.least_figure),
        replace(SEEN, least=report.least_seen),
        Quantity("position", "position (m or rad)", FLOORS * report.floor),
        Quantity("attitude", "attitude (rad)", FLOORS * report.floor),
        Quantity("velocity", "velocity (m/s or rad/s)", FLOORS * report.velocity_floor),
    )
    return tuple(
        quantity
        for quantity in candidates
        if any(quantity.value_of(row) is not None for row in report.rows)
    )


SEEN = Quantity("seen", "what is seen (1: just visible)")
"""What a learner sees: it is compared where no other error is declared and resolved."""


def is_idle(row: WorkPrecisionRow) -> bool:
    """Whether a setting changes no bit of the motion and saves no time: it is not shown."""
    return row.same and (row.cost is None or row.cost.high > 1 - _SAVING)


_SAVING = 0.03
"""Times differ by less of themselves from one measurement to the next."""


COST_SLACK, ERROR_SLACK = 0.03, 0.05
"""Relative: costs repeat to a few per cent only."""
Rows: TypeAlias = Sequence[WorkPrecisionRow]


class FrontPoint(Struct, frozen=True):
    """The place of a setting in the plot."""

    cost: Interval
    error: float

    def beats(self, rival: FrontPoint) -> bool:
        """Whether this is clearly better in one respect, and no worse in the other."""
        is_more_accurate = self.error * (1 + ERROR_SLACK) < rival.error
        is_no_worse = self.error <= rival.error * (1 + ERROR_SLACK)
        return (self.is_cheaper(rival) and is_no_worse) or (
            is_more_accurate and not rival.is_cheaper(self)
        )

    def is_cheaper(self, rival: FrontPoint) -> bool:
        """Whether this costs less, beyond what timing can tell."""
        is_separate = self.cost.high < rival.cost.low
        return is_separate and self.cost.value * (1 + COST_SLACK) < rival.cost.value


def front_point(row: WorkPrecisionRow, quantity: Quantity) -> FrontPoint | None:
    """The cost and error of a setting; `None` where it was lost, or not timed."""
    error = quantity.value_of(row)
    return None if row.cost is None or error is None else FrontPoint(row.cost, error)


def front(rows: Rows, quantity: Quantity = SEEN) -> tuple[WorkPrecisionRow, ...]:
    """Rows that say whether they are on the front, and otherwise which row dominates them.

    A row is dominated where another costs no more and errs no more, and is clearly better in one of
    the two. A lucky row is on no front, and dominates none. Where none errs there is no front.
    """
    points = ((n, front_point(row, quantity)) for n, row in enumerate(rows))
    places = {n: point for n, point in points if point is not None}
    if not any(place.error for place in places.values()):
        places = {}
    better = {
        n: [m for m, rival in places.items() if not rows[m].lucky and rival.beats(own_place)]
        for n, own_place in places.items()
    }

    def worth(n: int) -> tuple[float, int]:
        return places[n].cost.value * places[n].error, n

    placed_rows = []
    for n, row in enumerate(rows):
        rivals = better.get(n, [])
        best = min([m for m in rivals if not better[m]] or rivals, key=worth, default=None)
        on_front = n in better and not rivals and not row.lucky
        placed_rows.append(replace(row, front=on_front, dominated_by=best))
    return tuple(placed_rows)


def main_quantity(report: ScenarioReport) -> Quantity | None:
    """The first error that is resolved, else the first; `None` where no row has an error."""
    present = quantities(report)
    return next(
        (quantity for quantity in present if quantity.is_resolved(report.rows)),
        next(iter(present), None),
    )


def is_cut_short(report: ScenarioReport) -> bool:
    """Whether the search for stable timesteps ended because of the scenario's duration."""
    longest = report.duration / FEWEST_STEPS
    return any(math.isclose(row.searched[1], longest, rel_tol=1e-9) for row in report.stable)


def limit_text(row: StableRow) -> str:
    """A largest stable timestep with the digits on which theory and all runs agree, or a range.

    Theory at rest counts up to a tenth above: else the motion is lost far from rest. Where limits
    have islands, no digit is finer than the gaps between timesteps that were tried. A single number
    is never above them all: whoever takes it would lose the run.
    """
    assert row.largest is not None or row.bracket is not None
    if row.bracket is None:  # recorded before runs were compared
        return seconds_text(row.largest or 0.0, 2)
    low, high = row.bracket
    if row.islands is not None:
        low = min(low, high / max(1.0, widest_gaps([row])[0]))
    if row.theory and row.theory < high * (1 + _TOGETHER):
        low, high = min(low, row.theory), max(high, row.theory)
    digits = 0
    if low > 0:
        least = max(high - low, low * 10.0**-_MOST_DIGITS)
        digits = math.floor(math.log10(low)) - math.ceil(math.log10(least) - 1e-9) + 1
    if digits < 2:
        return f"{seconds_text(low, 2)} – {seconds_text(high, 2)}"
    value = float(f"{low:.{digits}g}")
    if value > high:
        value -= 10.0 ** (math.floor(math.log10(low)) + 1 - digits)
    return seconds_text(value, digits)


def widest_gaps(rows: Iterable[StableRow]) -> tuple[float, float]:
    """The largest ratios of timesteps that were tried next to each other: above half, and in all.

    They count up to the largest stable one; 0 without any.
    """
    near, far = [0.0], [0.0]
    for row in rows:
        top = row.searched[1] if row.largest is None else row.largest
        steps = [step for step, _, _ in row.tries if step <= top * (1 + 1e-9)]
        for step, following in pairwise(steps):
            (near if step >= top / 2 else far).append(following / step)
    return max(near), max(*near, *far)


_TOGETHER, _MOST_DIGITS = 0.1, 4
"""How far theory at rest may be above runs, relative, and the most digits of a limit."""
_SIGNS = "·∘•"
"""Of a timestep in a map: none, some or all of its runs were lost."""


def map_text(row: StableRow) -> str:
    """A sign for each timestep that was tried from all starts, from the shortest to the longest."""
    most = max((runs for _, runs, _ in row.tries), default=0)
    tries = [(step, runs, lost) for step, runs, lost in row.tries if 2 * runs > most > 2]
    if not any(lost for _, _, lost in tries):
        return ""
    signs = "".join(_SIGNS[(lost > 0) + (lost == runs)] for _, runs, lost in tries)
    return f"{seconds_text(tries[0][0], 2)} {signs} {seconds_text(tries[-1][0], 2)}"


def seconds_text(value: float, digits: int = 6) -> str:
    """A short time with its unit."""
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if value >= size * 0.9999995:
            return f"{float(f'{value / size:.{digits}g}'):.{max(digits, 6)}g} {unit}"
    return f"{value:.{digits}g} s"


def horizon_error_text(errors: Mapping[str, float]) -> str:
    """The errors at which predictions end."""
    return " / ".join(f"{error:.3g} {unit}" for unit, error in errors.items()) or "0.1"


def interval_text(value: Interval) -> str:
    """A figure in three digits with half the width of its interval, in per cent."""
    share = 100 * value.half_width
    return f"{value.value:.3g}" + (f" ± {share:.2g} %" if 0.05 <= share < math.inf else "")


def setting_text(setting: MeasuredSetting, like: MeasuredSetting | None = None) -> str:
    """A setting in words; solver, iterations and cone only where they differ from `like`."""
    parts = [f"{setting.integrator} at {seconds_text(setting.timestep)}"]
    return ", ".join([*parts, *solving_parts(setting, like)])


def solving_parts(setting: MeasuredSetting, like: MeasuredSetting | None = None) -> list[str]:
    """Solver, iterations and cone of a setting in words, where they differ from those of `like`."""
    parts = []
    if setting.solver and (like is None or setting.solver != like.solver):
        parts.append(setting.solver)
    if setting.iterations and (like is None or setting.iterations != like.iterations):
        many = "iteration" if setting.iterations == 1 else "iterations"
        parts.append(f"{setting.iterations} {many}")
    if setting.cone and (like is None or setting.cone != like.cone):
        parts.append(f"{setting.cone} cone")
    return parts + [f"{name} {value}" for name, value in setting.options]


def status_text(status: str) -> str:
    """How a run went, in words."""
    return "grew" if status == "slow-growth" else status


FIGURES = {
    "change": "change (1: just visible)",
    "parted": "change seen after (s)",
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


def row_name(row: EngineRow) -> str:
    """An engine with its precision and device, in words."""
    device = row.label or row.device
    parts = [row.title]
    if row.bits:
        parts.append(f"{row.bits} bits")
    if row.threads > 1:
        parts.append(f"{row.threads} threads")
    elif device not in ("", "cpu"):
        parts.append(device)
    return ", ".join(parts)
