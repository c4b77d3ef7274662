"""Which settings are worth their cost, and what that says of the scene's own.

Entry points: `front(points)`, `verdict(rows, points, own)`.

A setting is dominated where another costs no more and errs no more, and is clearly better in one of
the two. What differs by less than 3 % in cost or 5 % in error is no difference.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.numerics.reports.bench import MeasuredSetting, RowVerdict
from coursebuild.numerics.reports.points import seconds_text

COST_SLACK, ERROR_SLACK = 0.03, 0.05
"""Relative: costs repeat to a few per cent only."""


class FrontPoint(Struct, frozen=True):
    """A setting in the plane of cost and error."""

    cost: float
    """Relative to the scene's own setting."""
    error: float
    """In any unit; 0 is as good as can be told."""

    def beats(self, other: FrontPoint) -> bool:
        """Whether it is clearly better in one respect, and no worse in the other."""
        cost, error = 1 + COST_SLACK, 1 + ERROR_SLACK
        cheaper, exacter = self.cost * cost < other.cost, self.error * error < other.error
        no_dearer, no_worse = self.cost <= other.cost * cost, self.error <= other.error * error
        return (cheaper and no_worse) or (exacter and no_dearer)


class PlacedPoint(Struct, frozen=True):
    """Where a point lies."""

    front: bool
    dominated_by: int | None
    """The number of a better point; `None` on the front, or for what is no point."""


def front(points: Sequence[FrontPoint | None]) -> tuple[PlacedPoint, ...]:
    """Which points no other dominates; `None` is a setting that was lost."""
    better = [
        [] if mine is None else [j for j, one in enumerate(points) if one and one.beats(mine)]
        for mine in points
    ]
    on_it = [mine is not None and not found for mine, found in zip(points, better, strict=True)]
    return tuple(
        PlacedPoint(there, _best(points, found, on_it))
        for there, found in zip(on_it, better, strict=True)
    )


def _best(
    points: Sequence[FrontPoint | None], found: Sequence[int], on_it: Sequence[bool]
) -> int | None:
    """Of those that are better, the one whose cost and error together are least."""

    def worth(index: int) -> tuple[float, int]:
        one = points[index]
        assert one is not None
        return one.cost * one.error, index

    return min([j for j in found if on_it[j]] or found, key=worth, default=None)


# --------------------------------------------------------------------------------------- verdict


def verdict(
    settings: Sequence[MeasuredSetting],
    points: Sequence[FrontPoint | None],
    placed: Sequence[PlacedPoint],
    own: int,
    seen: float | None,
    reasons: Sequence[str],
    enough: int | None = None,
    *,
    hopeless: bool = False,
) -> RowVerdict:
    """What the measurement says of the scene's own setting, number `own`.

    `seen`: its error in a picture, where 1 is just visible; `None` where it is not known.
    `reasons`: why it has none.
    `enough`: the cheapest setting whose error is not seen; `None` where there is none.
    `hopeless`: whether the errors of all are.
    """
    noticeable = None if seen is None else seen >= 1
    mine, better = points[own], placed[own].dominated_by
    if reasons:
        return _lost(settings, points, placed, own, reasons)
    told = _noticed(seen) + _enough(settings, points, own, seen, enough, hopeless)
    if mine is None:
        text = "nothing was timed, so that no setting can be called better"
        return RowVerdict(False, None, None, None, noticeable, text + _noticed(seen))
    if better is None:
        text = "no other setting is cheaper without being less accurate"
        return RowVerdict(True, None, None, None, noticeable, text + told)
    other = points[better]
    assert other is not None
    cost, error = other.cost / mine.cost, other.error / mine.error if mine.error > 0 else 1.0
    text = f"{words(settings[better])} is {_compared(cost, error)}"
    return RowVerdict(False, better, cost, error, noticeable, text + told)


def _enough(
    settings: Sequence[MeasuredSetting],
    points: Sequence[FrontPoint | None],
    own: int,
    seen: float | None,
    enough: int | None,
    hopeless: bool,
) -> str:
    """With what a learner would notice nothing, where something is noticed now."""
    mine, other = points[own], None if enough is None else points[enough]
    if seen is None or seen < 1 or mine is None:
        return ""
    if enough is None or other is None:
        return ", and that of every other setting too" if hopeless else ""
    cost = f"{other.cost / mine.cost:.2g} times its cost"
    return f"; the cheapest without one that is seen is {words(settings[enough])}, at {cost}"


def _lost(
    settings: Sequence[MeasuredSetting],
    points: Sequence[FrontPoint | None],
    placed: Sequence[PlacedPoint],
    own: int,
    reasons: Sequence[str],
) -> RowVerdict:
    """Of an own setting under which the scene does not run; the best one that does is named."""
    text = f"the scene does not run under its own setting, {words(settings[own])}: "
    text += "; ".join(reasons)
    there = [(p.error, p.cost, i) for i, p in enumerate(points) if p and placed[i].front]
    better = min(there)[2] if there else None
    if better is not None:
        text += f"; {words(settings[better])} is the most accurate that does"
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
