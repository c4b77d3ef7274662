"""Which settings are worth their cost, and what that says of the scene's own.

Entry points: `front(rows)`, rows with their places; `verdict(rows, noticeable)`.

A setting is dominated where another costs no more and errs no more, and is clearly better in one of
the two. What differs by less than 3 % in cost or 5 % in error is no difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.numerics.reports.bench import MeasuredSetting, RowVerdict, WorkPrecisionRow
from coursebuild.numerics.reports.points import seconds_text

COST_SLACK, ERROR_SLACK = 0.03, 0.05
"""Relative: costs repeat to a few per cent only."""
Rows: TypeAlias = Sequence[WorkPrecisionRow]
Point: TypeAlias = tuple[float, float]
"""Cost and error."""


def _point(row: WorkPrecisionRow) -> Point | None:
    """What a setting costs, and its error; `None` where it was lost, or not timed."""
    if row.cost is None or row.seen is None:
        return None
    return row.cost, row.seen if row.figure is None else row.figure[0]


def front(rows: Rows) -> tuple[WorkPrecisionRow, ...]:
    """Rows with what is known of their places: which no other dominates, and which one does."""
    points = [_point(row) for row in rows]
    better = [
        [] if mine is None else [j for j, one in enumerate(points) if one and _beats(one, mine)]
        for mine in points
    ]
    on_it = [mine is not None and not found for mine, found in zip(points, better, strict=True)]

    def worth(index: int) -> tuple[float, int]:
        cost, error = points[index] or (0.0, 0.0)
        return cost * error, index

    return tuple(
        replace(
            row,
            front=there,
            dominated_by=min([j for j in found if on_it[j]] or found, key=worth, default=None),
        )
        for row, there, found in zip(rows, on_it, better, strict=True)
    )


def _beats(one: Point, other: Point) -> bool:
    """Whether one is clearly better in one respect, and no worse in the other."""
    cost, error = 1 + COST_SLACK, 1 + ERROR_SLACK
    cheaper, exacter = one[0] * cost < other[0], one[1] * error < other[1]
    no_dearer, no_worse = one[0] <= other[0] * cost, one[1] <= other[1] * error
    return (cheaper and no_worse) or (exacter and no_dearer)


# --------------------------------------------------------------------------------------- verdict


def verdict(rows: Rows, noticeable: Sequence[bool | None]) -> RowVerdict:
    """What the measurement says of the scene's own setting.

    `noticeable`: whether a learner sees the error of a row; `None` where that is not known.
    """
    own = next(number for number, row in enumerate(rows) if row.own)
    row, seen = rows[own], noticeable[own]
    if row.reasons:
        return _lost(rows, row)
    error = None if seen is None else row.seen
    mine, told = _point(row), _noticed(error)
    if mine is None:
        text = "nothing was timed, so that no setting can be called better"
        return RowVerdict(False, None, None, None, seen, text + told)
    if error is not None and error >= 1:
        told += _enough(
            rows,
            mine[0],
            hopeless=all(n for r, n in zip(rows, noticeable, strict=True) if r.seen is not None),
        )
    if row.dominated_by is None:
        text = "no other setting is cheaper without being less accurate"
        return RowVerdict(True, None, None, None, seen, text + told)
    better = rows[row.dominated_by]
    other = _point(better)
    assert other is not None
    ratios = other[0] / mine[0], other[1] / mine[1] if mine[1] > 0 else 1.0
    text = f"{words(better.setting)} is {_compared(*ratios)}"
    return RowVerdict(False, row.dominated_by, *ratios, seen, text + told)


def _enough(rows: Rows, own: float, *, hopeless: bool) -> str:
    """With what a learner would notice nothing, where something is noticed now."""
    unseen = [row for row in rows if row.seen is not None and row.seen < 1 and row.cost is not None]
    if not unseen:
        return ", and that of every other setting too" if hopeless else ""
    least = min(unseen, key=lambda row: row.cost or 0.0)
    cost = f"{(least.cost or 0.0) / own:.2g} times its cost"
    return f"; the cheapest without one that is seen is {words(least.setting)}, at {cost}"


def _lost(rows: Rows, row: WorkPrecisionRow) -> RowVerdict:
    """Of an own setting under which the scene does not run; the best one that does is named."""
    text = f"the scene does not run under its own setting, {words(row.setting)}: "
    text += "; ".join(row.reasons)
    found = [
        (point[1], point[0], n) for n, r in enumerate(rows) if r.front and (point := _point(r))
    ]
    better = min(found)[2] if found else None
    if better is not None:
        text += f"; {words(rows[better].setting)} is the most accurate that does"
    return RowVerdict(False, better, None, None, None, text)


def words(setting: MeasuredSetting) -> str:
    """A setting in a sentence."""
    more = [setting.solver and f"{setting.solver}, at most {setting.iterations} iterations"]
    more.append(setting.cone and f"{setting.cone} cone")
    text = f"{setting.integrator} at {seconds_text(setting.timestep)}"
    return ", ".join((text, *(part for part in more if part)))


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
