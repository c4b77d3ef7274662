"""What steps cost, relative to each other, on a machine that does other things too.

Entry point: `timed(jobs, own, clock)`.

1. Candidates are timed in turns, each beside the scene's own setting and in alternating order, so
   that what slows the machine for a while slows all.
2. Of the times of each, the lowest tenth counts: it forgets those that were disturbed, and does not
   hang on a single lucky one. Rounds go on until all ratios are known well enough, or a cap is
   reached.
3. The least time of all rounds is what an undisturbed machine takes; the median over it says how
   much it was disturbed.

The clock is an argument: processor time of the thread serves best, since it stands still while
others run. Nothing is collected as garbage meanwhile, which is the caller's to see to.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from typing import TypeAlias

from msgspec import Struct

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

FEWEST, MOST = 24, 60
"""Rounds."""
QUICK_MOST = 24
ENOUGH = 0.005
"""Relative uncertainty of a ratio at which rounds end."""
_PARTS = 4
"""Into so many parts the rounds are cut, to see how much ratios vary."""


class Timing(Struct, frozen=True):
    """What a candidate took."""

    ratio: float
    """Its time over the own setting's, the lowest tenths of both."""
    uncertainty: float
    """Of the ratio, relative: its standard error, from parts of the rounds."""
    least: float
    """Least time of one job, ns."""
    spread: float
    """Median over least time."""
    rounds: int


def timed(
    jobs: Sequence[Job],
    own: int,
    clock: Clock,
    *,
    idle: Sequence[float] | None = None,
    most: int = MOST,
    enough: float = ENOUGH,
) -> tuple[Timing, ...]:
    """Time jobs, of which number `own` is what others are compared with.

    `idle`: for each job the ns that it takes for what is not to be timed.

    Returns:
        A timing for each job; the ratio of `own` is 1.
    """
    for job in jobs:  # caches are warm, and memory is there
        job()
    aside = [0.0] * len(jobs) if idle is None else idle
    times: list[list[float]] = [[] for _ in jobs]
    others = [index for index in range(len(jobs)) if index != own]

    def take(index: int) -> None:
        times[index].append(max(0.0, _once(jobs[index], clock) - aside[index]))

    for turn in range(most):
        for place, index in enumerate(others or [own]):
            for one in (own, index) if (turn + place) % 2 else (index, own):
                take(one)
        if turn + 1 >= FEWEST and all(
            _uncertainty(times[index], times[own]) <= enough for index in others
        ):
            break
    return tuple(_timing(mine, times[own], exact=index == own) for index, mine in enumerate(times))


def _once(job: Job, clock: Clock) -> int:
    before = clock()
    job()
    return clock() - before


def _timing(times: Sequence[float], own: Sequence[float], *, exact: bool) -> Timing:
    least = min(times)
    return Timing(
        ratio=1.0 if exact else _ratio(times, own),
        uncertainty=0.0 if exact else _uncertainty(times, own),
        least=least,
        spread=statistics.median(times) / least if least > 0 else math.inf,
        rounds=len(times),
    )


def _ratio(times: Sequence[float], own: Sequence[float]) -> float:
    ours = _low(own)
    return _low(times) / ours if ours > 0 else math.nan


def _low(times: Sequence[float]) -> float:
    """The lowest tenth, between the two times that are nearest to it."""
    ordered = sorted(times)
    place = (len(ordered) - 1) / 10
    below = math.floor(place)
    above = min(below + 1, len(ordered) - 1)
    return ordered[below] + (place - below) * (ordered[above] - ordered[below])


def _uncertainty(times: Sequence[float], own: Sequence[float]) -> float:
    """Relative standard error of a ratio, from the ratios of parts of the rounds."""
    if len(times) < _PARTS:
        return math.inf
    parts = [_ratio(a, b) for a, b in zip(_cut(times), _cut(own), strict=True)]
    middle = statistics.fmean(parts)
    if not middle > 0:
        return math.inf
    return statistics.stdev(parts) / (math.sqrt(_PARTS) * middle)


def _cut(times: Sequence[float]) -> list[Sequence[float]]:
    size = len(times) // _PARTS
    return [times[at : at + size] for at in range(0, size * _PARTS, size)]
