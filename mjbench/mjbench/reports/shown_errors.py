"""Which errors of reports are shown, which settings are worth their cost, and texts of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from msgspec.structs import replace

from mjbench.reports import Interval
from mjbench.reports.scene_report import (
    FLOORS,
    ErrorQuantity,
    MeasuredRun,
    MeasuredSetting,
    WorkPrecisionRow,
)

INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4", "discrete")
"""Integrators in the order in which they are shown, which also sets their colour and mark."""
FEWEST_STEPS = 20
"""Steps of a scenario at the longest timestep that is tried for stability."""


SEEN = ErrorQuantity("seen", "what is seen (1: just visible)", 0.0, False)
"""What a learner sees: it is compared where no other error is declared and resolved."""


STEPPED = ErrorQuantity("step_error", "what is seen of steps (1: just visible)", 0.0, False)
"""The same without the error of the model of contacts, which no timestep mends."""


def quantities(
    rows: Sequence[WorkPrecisionRow],
    figure: ErrorQuantity,
    least_seen: float,
    floors: tuple[float, float],
) -> tuple[ErrorQuantity, ...]:
    """The errors that some row has, what the scenario declares to be measured first.

    `floors`: those of the reference, of places and velocities.
    """
    place, speed = (FLOORS * floor for floor in floors)
    candidates = (
        figure,
        replace(STEPPED, least=least_seen),
        replace(SEEN, least=least_seen),
        ErrorQuantity("position", "position (m or rad)", place, False),
        ErrorQuantity("attitude", "attitude (rad)", place, False),
        ErrorQuantity("velocity", "velocity (m/s or rad/s)", speed, False),
    )
    return tuple(q for q in candidates if any(q.value_of(row) is not None for row in rows))


def main_quantity(
    present: Sequence[ErrorQuantity], rows: Sequence[MeasuredRun]
) -> ErrorQuantity | None:
    """The first error that is resolved, else the first; `None` where no row has an error."""
    resolved = (quantity for quantity in present if quantity.is_resolved(rows))
    return next(resolved, next(iter(present), None))


def is_idle(row: WorkPrecisionRow) -> bool:
    """Whether a setting changes no bit of the motion and saves no time: it is not shown."""
    return row.same and (row.cost is None or row.cost.high > 1 - _SAVING)


_SAVING = 0.03
"""Times differ by less of themselves from one measurement to the next."""


COST_SLACK, ERROR_SLACK = 0.03, 0.05
"""Relative: costs repeat to a few per cent only."""
Rows: TypeAlias = Sequence[WorkPrecisionRow]


def is_cheaper(cost: Interval, rival: Interval) -> bool:
    """Whether a cost is less than another, beyond what timing can tell."""
    return cost.high < rival.low and cost.value * (1 + COST_SLACK) < rival.value


def is_no_dearer(cost: Interval, rival: Interval) -> bool:
    """Whether a cost is no more than another: where times are uncertain, by the likeliest ones."""
    return cost.value <= rival.value * (1 + COST_SLACK)


def seconds_text(value: float, digits: int = 6) -> str:
    """A short time with its unit."""
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if value >= size * 0.9999995:
            return f"{float(f'{value / size:.{digits}g}'):.{max(digits, 6)}g} {unit}"
    return f"{value:.{digits}g} s"


def horizon_error_text(errors: Mapping[str, float]) -> str:
    """The errors at which predictions end."""
    return " or ".join(f"{error:.3g} {unit}" for unit, error in errors.items()) or "0.1"


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


def interval_text(value: Interval | None) -> str:
    """A figure in three digits with half the width of its interval, in per cent; empty for none."""
    if value is None:
        return ""
    share = 100 * value.half_width
    return f"{value.value:.3g}" + (f" ± {share:.2g} %" if 0.05 <= share < 1e3 else "")
