"""Which settings are worth their cost, and what that says of the scene's own.

Entry points: `front(rows)`, rows that know whether they are on the front;
`verdict(rows, noticeable)`.

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


def _place(row: WorkPrecisionRow) -> FrontPoint | None:
    """The cost and error of a setting; `None` where it was lost, or not timed."""
    if row.cost is None or row.seen is None:
        return None
    return FrontPoint(row.cost, row.seen if row.figure is None else row.figure[0])


def front(rows: Rows) -> tuple[WorkPrecisionRow, ...]:
    """Rows that say whether they are on the front, and otherwise which row dominates them."""
    places = {n: place for n, row in enumerate(rows) if (place := _place(row)) is not None}
    better = {
        n: [m for m, rival in places.items() if rival.beats(own_place)]
        for n, own_place in places.items()
    }

    def worth(n: int) -> tuple[float, int]:
        return places[n].cost.value * places[n].error, n

    placed_rows = []
    for n, row in enumerate(rows):
        rivals = better.get(n, [])
        best = min([m for m in rivals if not better[m]] or rivals, key=worth, default=None)
        placed_rows.append(replace(row, front=n in better and not rivals, dominated_by=best))
    return tuple(placed_rows)


def verdict(rows: Rows, noticeable: Sequence[bool | None]) -> RowVerdict:
    """The verdict on the scene's own setting.

    `noticeable`: whether a learner sees the error of a row; `None` where that is not known.
    """
    own_index = next(number for number, row in enumerate(rows) if row.own)
    row, is_noticeable = rows[own_index], noticeable[own_index]
    if row.reasons:
        return _verdict_of_lost(rows, row)
    error = None if is_noticeable is None else row.seen
    own_place, remark = _place(row), _describe_error(error)
    if own_place is None:
        text = "nothing was timed, so that no setting can be called better"
        return RowVerdict(False, None, None, None, is_noticeable, text + remark)
    if error is not None and error >= 1:
        remark += _cheapest_unseen(
            rows,
            own_place.cost.value,
            hopeless=all(n for r, n in zip(rows, noticeable, strict=True) if r.seen is not None),
        )
    if row.dominated_by is None:
        text = "no other setting is cheaper without being less accurate"
        return RowVerdict(True, None, None, None, is_noticeable, text + remark)
    better = rows[row.dominated_by]
    better_place = _place(better)
    assert better_place is not None
    ratios = (
        better_place.cost.value / own_place.cost.value,
        better_place.error / own_place.error if own_place.error else 1.0,
    )
    text = f"{setting_text(better.setting)} is {_describe_ratios(*ratios)}"
    return RowVerdict(False, row.dominated_by, *ratios, is_noticeable, text + remark)


def _cheapest_unseen(rows: Rows, own_cost: float, *, hopeless: bool) -> str:
    """The cheapest setting with an error that no learner notices, in words."""
    unseen = [row for row in rows if row.seen is not None and row.seen < 1 and row.cost is not None]
    if not unseen:
        return ", and that of every other setting too" if hopeless else ""
    cost, least = min((row.cost.value, n) for n, row in enumerate(unseen) if row.cost)
    name, times = setting_text(unseen[least].setting), f"{cost / own_cost:.2g} times its cost"
    return f"; the cheapest without one that is seen is {name}, at {times}"


def _verdict_of_lost(rows: Rows, row: WorkPrecisionRow) -> RowVerdict:
    """The verdict on a scene that does not run under its own setting: the best that does."""
    text = f"the scene does not run under its own setting, {setting_text(row.setting)}: "
    text += "; ".join(row.reasons)
    candidates = [
        (p.error, p.cost.value, n) for n, r in enumerate(rows) if r.front and (p := _place(r))
    ]
    better = min(candidates)[2] if candidates else None
    if better is not None:
        text += f"; {setting_text(rows[better].setting)} is the most accurate that does"
    return RowVerdict(False, better, None, None, None, text)


def _describe_ratios(cost: float, error: float) -> str:
    cheap = f"takes {cost:.2g} of the time" if cost < 1 / 1.005 else "takes no more time"
    if error < 1 / (1 + ERROR_SLACK):
        exact = f"errs {1 / error:.2g} times less" if 1 / error < 1e4 else "errs far less"
    else:
        exact = "errs no more"
    return f"better: it {cheap} and {exact}"


def _describe_error(error: float | None) -> str:
    if error is None:
        return "; whether a learner would notice its error is not known"
    if error >= 1:
        return f"; a learner would notice its error, which is {error:.2g} times what can be seen"
    return f"; a learner would not notice its error, which is {error:.2g} of what can be seen"
