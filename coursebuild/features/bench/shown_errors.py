"""Words for what is measured: settings, times, figures of sweeps, engines."""

from __future__ import annotations

import math
from collections.abc import Mapping

from coursebuild.core.drawing.scales import tick_texts
from coursebuild.core.model.measurements import EngineRow, Interval, MeasuredSetting, SweepRow

INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4", "discrete")
"""Integrators in the order in which they are shown, which also sets their colour and mark."""


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


def setting_text(setting: MeasuredSetting) -> str:
    """A setting in words."""
    parts = [f"{setting.integrator} at {seconds_text(setting.timestep)}"]
    return ", ".join([*parts, *solving_parts(setting)])


def solving_parts(setting: MeasuredSetting) -> list[str]:
    """Solver, iterations and cone of a setting in words, those that it has."""
    parts = [setting.solver] if setting.solver else []
    if setting.iterations:
        many = "iteration" if setting.iterations == 1 else "iterations"
        parts.append(f"{setting.iterations} {many}")
    parts += [f"{setting.cone} cone"] if setting.cone else []
    return parts + [f"{name} {value}" for name, value in setting.options]


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
}
"""The figures that are measured for every value, with their labels."""


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
