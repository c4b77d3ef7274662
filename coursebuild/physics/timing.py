"""What steps cost, relative to each other, on a machine that does other things too.

Entry point: `timed(jobs, own, clock)`.

1. Every candidate is timed beside the scene's own setting, one right after the other and in
   alternating order, so that what slows the machine slows both: their ratio is what counts.
2. The median of the ratios forgets the disturbed ones. Rounds go on until all medians are known
   well enough, or a cap is reached.
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

from coursebuild.values import dataclass

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

FEWEST, MOST = 12, 120
"""Rounds."""
QUICK_MOST = 30
ENOUGH = 0.005
"""Relative uncertainty of a median at which rounds end."""
_MAD = 1.4826
"""Standard deviations in a median of absolute deviations, of a normal distribution."""
_MEDIAN = 1.2533
"""Uncertainty of a median over that of a mean."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What a candidate took."""

    ratio: float
    """Median of its time over the own setting's beside it."""
    uncertainty: float
    """Of the ratio, relative: one standard error of the median."""
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
    ratios: list[list[float]] = [[] for _ in jobs]
    open_ones = [index for index in range(len(jobs)) if index != own]
    for turn in range(most):
        for place, index in enumerate(open_ones):
            first, second = (own, index) if (turn + place) % 2 else (index, own)
            a = max(0.0, _once(jobs[first], clock) - aside[first])
            b = max(0.0, _once(jobs[second], clock) - aside[second])
            theirs, ours = (b, a) if first == own else (a, b)
            times[index].append(theirs)
            times[own].append(ours)
            if ours > 0:
                ratios[index].append(theirs / ours)
        if not open_ones:
            times[own].append(max(0.0, _once(jobs[own], clock) - aside[own]))
        if turn + 1 >= FEWEST:
            open_ones = [i for i in open_ones if not _uncertainty(ratios[i]) <= enough]
            if not open_ones:
                break
    return tuple(_timing(times[i], [1.0] if i == own else ratios[i]) for i in range(len(jobs)))


def _once(job: Job, clock: Clock) -> int:
    before = clock()
    job()
    return clock() - before


def _timing(times: Sequence[float], ratios: Sequence[float]) -> Timing:
    least = min(times)
    return Timing(
        ratio=statistics.median(ratios) if ratios else math.nan,
        uncertainty=_uncertainty(ratios),
        least=least,
        spread=statistics.median(times) / least if least > 0 else math.inf,
        rounds=len(times),
    )


def _uncertainty(ratios: Sequence[float]) -> float:
    """Relative standard error of the median, from the median of absolute deviations."""
    if not ratios:
        return math.inf
    middle = statistics.median(ratios)
    off = statistics.median(abs(one - middle) for one in ratios)
    return _MEDIAN * _MAD * off / (math.sqrt(len(ratios)) * middle) if middle > 0 else math.inf
