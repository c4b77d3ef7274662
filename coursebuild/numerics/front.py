"""Which settings are worth their cost, and what that says of the scene's own.

Entry points: `front(rows)`, rows with their places; `verdict(rows, noticeable)`.

A setting is dominated where another costs no more and errs no more, and is clearly better in one of
the two. Costs whose intervals meet do not differ, nor do those within 3 % or errors within 5 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import RowVerdict, WorkPrecisionRow
from coursebuild.numerics.reports.text import setting_text

COST_SLACK, ERROR_SLACK = 0.03, 0.05
"""Relative: costs repeat to a few per cent only."""
Rows: TypeAlias = Sequence[WorkPrecisionRow]


class FrontPoint(Struct, frozen=True):
    """Where a setting is in the plot."""

    cost: Interval
    error: float

    def beats(self, other: FrontPoint) -> bool:
        """Whether one is clearly better in one respect, and no worse in the other."""
        exacter = self.error * (1 + ERROR_SLACK) < other.error
        no_worse = self.error <= other.error * (1 + ERROR_SLACK)
        return (self.cheaper(other) and no_worse) or (exacter and not other.cheaper(self))

    def cheaper(self, other: FrontPoint) -> bool:
        """Whether it costs less, beyond what can be told."""
        apart = self.cost.high < other.cost.low
        return apart and self.cost.value * (1 + COST_SLACK) < other.cost.value


def _place(row: WorkPrecisionRow) -> FrontPoint | None:
    """What a setting costs, and its error; `None` where it was lost, or not timed."""
    if row.cost is None or row.seen is None:
        return None
    return FrontPoint(row.cost, row.seen if row.figure is None else row.figure[0])


def front(rows: Rows) -> tuple[WorkPrecisionRow, ...]:
    """Rows with what is known of their places: which no other dominates, and which one does."""
    places = {n: place for n, row in enumerate(rows) if (place := _place(row)) is not None}
    better = {
        n: [m for m, other in places.items() if other.beats(mine)] for n, mine in places.items()
    }

    def worth(n: int) -> tuple[float, int]:
        return places[n].cost.value * places[n].error, n

    found = []
    for n, row in enumerate(rows):
        others = better.get(n, [])
        best = min([m for m in others if not better[m]] or others, key=worth, default=None)
        found.append(replace(row, front=n in better and not others, dominated_by=best))
    return tuple(found)


def verdict(rows: Rows, noticeable: Sequence[bool | None]) -> RowVerdict:
    """What the measurement says of the scene's own setting.

    `noticeable`: whether a learner sees the error of a row; `None` where that is not known.
    """
    own = next(number for number, row in enumerate(rows) if row.own)
    row, seen = rows[own], noticeable[own]
    if row.reasons:
        return _lost(rows, row)
    error = None if seen is None else row.seen
    mine, told = _place(row), _noticed(error)
    if mine is None:
        text = "nothing was timed, so that no setting can be called better"
        return RowVerdict(False, None, None, None, seen, text + told)
    if error is not None and error >= 1:
        told += _enough(
            rows,
            mine.cost.value,
            hopeless=all(n for r, n in zip(rows, noticeable, strict=True) if r.seen is not None),
        )
    if row.dominated_by is None:
        text = "no other setting is cheaper without being less accurate"
        return RowVerdict(True, None, None, None, seen, text + told)
    better = rows[row.dominated_by]
    other = _place(better)
    assert other is not None
    ratios = other.cost.value / mine.cost.value, other.error / mine.error if mine.error else 1.0
    text = f"{setting_text(better.setting)} is {_compared(*ratios)}"
    return RowVerdict(False, row.dominated_by, *ratios, seen, text + told)


def _enough(rows: Rows, own: float, *, hopeless: bool) -> str:
    """With what a learner would notice nothing, where something is noticed now."""
    unseen = [row for row in rows if row.seen is not None and row.seen < 1 and row.cost is not None]
    if not unseen:
        return ", and that of every other setting too" if hopeless else ""
    cost, least = min((row.cost.value, n) for n, row in enumerate(unseen) if row.cost)
    name, times = setting_text(unseen[least].setting), f"{cost / own:.2g} times its cost"
    return f"; the cheapest without one that is seen is {name}, at {times}"


def _lost(rows: Rows, row: WorkPrecisionRow) -> RowVerdict:
    """Of an own setting under which the scene does not run; the best one that does is named."""
    text = f"the scene does not run under its own setting, {setting_text(row.setting)}: "
    text += "; ".join(row.reasons)
    found = [(p.error, p.cost.value, n) for n, r in enumerate(rows) if r.front and (p := _place(r))]
    better = min(found)[2] if found else None
    if better is not None:
        text += f"; {setting_text(rows[better].setting)} is the most accurate that does"
    return RowVerdict(False, better, None, None, None, text)


def _compared(cost: float, error: float) -> str:
    cheap = f"takes {cost:.2g} of the time" if cost < 1 / 1.005 else "takes no more time"
    if error < 1 / (1 + ERROR_SLACK):
        exact = f"errs {1 / error:.2g} times less" if 1 / error < 1e4 else "errs far less"
    else:
        exact = "errs no more"
    return f"better: it {cheap} and {exact}"


def _noticed(seen: float | None) -> str:
    if seen is None:
        return "; whether a learner would notice its error is not known"
    if seen >= 1:
        return f"; a learner would notice its error, which is {seen:.2g} times what can be seen"
    return f"; a learner would not notice its error, which is {seen:.2g} of what can be seen"
