"""The errors of settings by columns, and which setting is worse in which of them.

A column is an error of one thing over a stretch of time: the whole run, and its halves where these
were measured. Errors of timestep and solver stand apart from those of the model of contacts. One
maximum over all of them would hide that a longer timestep doubles the rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from mjbench.reports.scene_report import FLOORS, ScenarioReport, WorkPrecisionRow
from mjbench.reports.shown_errors import (
    ERROR_SLACK,
    Rows,
    is_cheaper,
    is_no_dearer,
)

Column: TypeAlias = tuple[str, str]
"""The name of an error, and a stretch of time in words."""
Columns: TypeAlias = Mapping[Column, float]

WHOLE, HALVES = "over the whole run", ("in its first half", "in its second half")
LOST = "lost"
"""The column of a run that is lost, which has no errors."""
_ROUNDED = 1e-9
"""Relative changes of what is conserved below this are those of rounding."""
_NEGLIGIBLE = 1e-3
"""The part of an error over the whole run below which it is none in a part of it."""
LABELS = {
    "step_error": "what is seen of steps",
    "seen": "what is seen",
    "position": "the error of position",
    "attitude": "the error of attitude",
    "velocity": "the error of velocity",
    "energy_drift": "the drift of energy",
    "momentum_drift": "the drift of momentum",
    "slip": "creep",
    "contact_model": "the error of the model of contacts",
}
"""What columns are called in sentences; `figure` is called as the scenario says."""


def columns_of(row: WorkPrecisionRow, contact_model: Mapping[str, float]) -> Columns:
    """The errors of a row; none where it was lost."""
    values: dict[Column, float] = {}
    if row.status != "ok":
        return values
    for name in ("figure", "position", "attitude", "velocity"):
        if (pair := getattr(row, name)) is not None:
            values[name, WHOLE] = pair[0]
    visible = "seen" if row.step_error is None else "step_error"
    for name in (visible, "energy_drift", "momentum_drift", "slip"):
        if (value := getattr(row, name)) is not None:
            values[name, WHOLE] = abs(value)
    for name, halves in row.halves.items():
        values |= {(name, span): value for span, value in zip(HALVES, halves, strict=True)}
    if contact_model:
        values["contact_model", WHOLE] = contact_model.get(row.setting.cone, 0.0)
    return {column: value for column, value in values.items() if math.isfinite(value)}


def leasts_of(report: ScenarioReport) -> dict[str, float]:
    """Below which errors mean nothing, by the name of a column."""
    floors = report.floors or (report.floor, report.velocity_floor)
    place, speed = (FLOORS * floor for floor in floors)
    return {
        "figure": report.least_figure,
        "seen": report.least_seen,
        "step_error": report.least_seen,
        "contact_model": report.least_seen,
        "velocity": speed,
        **dict.fromkeys(("position", "attitude", "slip"), place),
        **dict.fromkeys(("energy_drift", "momentum_drift"), _ROUNDED),
    }


def row_ratios(
    report: ScenarioReport, baseline: WorkPrecisionRow, rival: WorkPrecisionRow
) -> dict[Column, float]:
    """How many times as large the errors of a row are as those of another, see `ratios`."""
    pair = [columns_of(row, report.contact_model) for row in (baseline, rival)]
    return ratios(pair[0], pair[1], leasts_of(report))


def ratios(
    baseline: Columns, rival_columns: Columns, leasts: Mapping[str, float]
) -> dict[Column, float]:
    """How many times as large other errors are, by columns that both have; 1 where none is known.

    Two errors that the reference does not resolve are alike.
    """
    result: dict[Column, float] = {}
    for column in baseline.keys() & rival_columns.keys():
        least = _least(column, baseline, leasts) * (1 + 1e-9)
        before, now = (max(values[column], least) for values in (baseline, rival_columns))
        result[column] = now / before if before else (math.inf if now else 1.0)
    return result


def _least(column: Column, baseline: Columns, leasts: Mapping[str, float]) -> float:
    """Below which an error means nothing, in a part of the run also beside that of the whole."""
    whole = 0.0 if column[1] == WHOLE else baseline.get((column[0], WHOLE), 0.0)
    return max(leasts.get(column[0], 0.0), _NEGLIGIBLE * whole)


class Spread(Struct, frozen=True):
    """How many times as large an error is as another, from several starts."""

    column: Column
    low: float
    high: float

    def text(self, figure: str, *, is_least: bool) -> str:
        """In words: what is how many times as large, and when; `is_least`: so many at least."""
        if self.column[0] == LOST:
            return "it is lost"
        times = times_text(self.low, math.inf if is_least else self.high)
        return f"{self.label(figure)} is {times} as large {self.column[1]}"

    def label(self, figure: str) -> str:
        """What errs, in words."""
        name = self.column[0]
        return (figure.partition(" [")[0] or "the figure") if name == "figure" else LABELS[name]


def worse_texts(
    report: ScenarioReport, baseline: WorkPrecisionRow, starts: Sequence[Mapping[Column, float]]
) -> tuple[str, ...]:
    """In which errors a setting is worse, or not known to be no worse, each where it is so most.

    Where no error of the other setting is known, only that it is less than can be, a factor is the
    least.
    """
    columns, leasts = columns_of(baseline, report.contact_model), leasts_of(report)
    texts: dict[str, str] = {}
    for part in spreads(starts):
        least = _least(part.column, columns, leasts)
        is_vague = bool(least) and columns.get(part.column, math.inf) <= least * (1 + 1e-9)
        if part.high > 1 + ERROR_SLACK and part.column[0] not in texts:
            is_least = is_vague and part.low > 1 + ERROR_SLACK
            texts[part.column[0]] = part.text(report.figure, is_least=is_least)
    return tuple(texts.values())


def spreads(starts: Sequence[Mapping[Column, float]]) -> list[Spread]:
    """The ratios of all starts together, the worst column first."""
    columns = {column for start in starts for column in start}
    result = []
    for column in columns:
        values = [start[column] for start in starts if column in start]
        result.append(Spread(column, min(values), max(values)))
    return sorted(result, key=lambda part: (-part.low, -part.high, part.column[1] != WHOLE))


def times_text(low: float, high: float) -> str:
    """A factor, or the factors between which it lies, in words; the second may be infinite."""
    least, most = number_text(low), number_text(high)
    if least == most:
        return f"{least} times"
    return f"at least {least} times" if math.isinf(high) else f"{least} to {most} times"


def number_text(number: float) -> str:
    """A factor with two digits and no exponent where zeros do: `610`."""
    return f"{float(f'{number:.2g}'):g}" if number < 1e4 else "over 10000"


def rounded_text(value: float, digits: int) -> str:
    """A number in so many digits; large ones without a power of ten."""
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if value >= 100 else text


def mark_dominated(report: ScenarioReport) -> Rows:
    """Rows that say whether another is better in cost or an error, and in no column worse.

    Of those that are better the one worth least is named. Where none errs there is no front.
    """
    rows, leasts = report.rows, leasts_of(report)
    columns = [columns_of(row, report.contact_model) for row in rows]
    present = {n for n, row in enumerate(rows) if row.cost is not None and columns[n]}
    if not any(value for n in present for value in columns[n].values()):
        present = set()

    def worth(n: int) -> float:
        visible = columns[n].get((report.main, WHOLE), 0.0)
        cost = rows[n].cost
        return (0.0 if cost is None else cost.value) * max(visible, leasts.get(report.main, 0.0))

    def beats(rival: int, baseline: int) -> bool:
        if rows[rival].parted is not None and rows[baseline].parted is None:
            return False  # it has no error that is known, for it is off
        prices = [cost for n in (rival, baseline) if (cost := rows[n].cost)]
        changes = ratios(columns[baseline], columns[rival], leasts).values()
        if any(change > 1 + ERROR_SLACK for change in changes):
            return False
        is_nearer = any(change * (1 + ERROR_SLACK) < 1 for change in changes)
        return is_cheaper(*prices) or (is_nearer and is_no_dearer(*prices))

    better = {
        n: [m for m in sorted(present) if m != n and not rows[m].lucky and beats(m, n)]
        for n in present
    }
    placed_rows = []
    for n, row in enumerate(rows):
        rivals = better.get(n, [])
        unbeaten = [m for m in rivals if not better[m]] or rivals
        best = min(unbeaten, key=lambda m: (worth(m), m), default=None)
        on_front = n in present and not rivals and not row.lucky
        placed_rows.append(replace(row, front=on_front, dominated_by=best))
    return tuple(placed_rows)
