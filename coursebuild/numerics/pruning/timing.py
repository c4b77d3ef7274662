"""What a change saves: time, as a ratio of two models stepped in turns, and bytes.

Entry point: `time_ratio`.

Both are stepped through the same part of a scenario, in turns and in changing order, so that what
else the machine does falls on both alike. Time is that of this thread on the processor; the median
of the ratios of neighbours counts.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from typing import Any

import mujoco
from msgspec import Struct

from coursebuild.numerics.engine import advance
from coursebuild.numerics.pruning.cases import Case, begin, command
from coursebuild.numerics.pruning.compare import quiet
from coursebuild.numerics.pruning.mapping import Mapping, transfer

Clock = Callable[[], float]
"""Seconds that this thread has used the processor."""
_BLOCK = 0.006
"""Seconds that one measurement should take at least."""
_ROUNDS, _QUICK_ROUNDS = 12, 4


class Ratio(Struct, frozen=True):
    """How much faster a model is than another."""

    value: float
    """Over 1 where it is faster: the median."""
    spread: float
    """Half the middle half of the ratios, relative."""

    @property
    def certain(self) -> bool:
        """Whether it is another than 1 beyond what the measurement can tell."""
        return abs(self.value - 1.0) > max(0.03, 2 * self.spread)


def time_ratio(
    base: Any, changed: Any, mapping: Mapping, cases: Sequence[Case], clock: Clock, *, quick: bool
) -> Ratio | None:
    """Time of the base over that of the changed model, over all the scenarios.

    `None` where there is no scenario, or the clock stands still.
    """
    if not cases:
        return None
    quiet(base), quiet(changed)
    share = _BLOCK / len(cases)
    runs = [_prepared(base, changed, mapping, case, clock, share) for case in cases]
    ratios: list[float] = []
    for turn in range(_QUICK_ROUNDS if quick else _ROUNDS):
        one = two = 0.0
        for first, second in runs:
            if turn % 2:
                late = second.take(clock)
                one, two = one + first.take(clock), two + late
            else:
                one, two = one + first.take(clock), two + second.take(clock)
        if one <= 0 or two <= 0:
            return None
        ratios.append(one / two)
    quarters = statistics.quantiles(ratios, n=4)
    value = statistics.median(ratios)
    return Ratio(value, (quarters[2] - quarters[0]) / 2 / value)


class _Stretch:
    """The first steps of a scenario, again and again."""

    def __init__(self, model: Any, start: Any, case: Case, ctrl: Any) -> None:
        self._model = model
        self._start = start
        self._data = mujoco.MjData(model)
        self._case = case
        self._ctrl = ctrl
        self.steps = 1
        self.times = 1

    def take(self, clock: Clock) -> float:
        """Seconds that the steps take."""
        total = 0.0
        for _ in range(self.times):
            mujoco.mj_copyData(self._data, self._model, self._start)
            began = clock()
            self._step()
            total += clock() - began
        return total

    def _step(self) -> None:
        case, done = self._case, 0
        while done < self.steps:
            given = command(case, done)
            if given is not None:
                self._data.ctrl[:] = given[self._ctrl]
            part = self.steps - done
            if case.controls and case.hold:
                part = min(part, case.hold - done % case.hold)
            advance(self._model, self._data, part)
            done += part


def _prepared(
    base: Any, changed: Any, mapping: Mapping, case: Case, clock: Clock, share: float
) -> tuple[_Stretch, _Stretch]:
    data, other = begin(base, case), mujoco.MjData(changed)
    transfer(base, data, mapping, changed, other)
    first = _Stretch(base, data, case, slice(None))
    second = _Stretch(changed, other, case, mapping.ctrl)
    while first.steps < case.steps and first.take(clock) < share:
        first.steps = min(case.steps, first.steps * 2)
    while first.times < 1024 and first.take(clock) < share:
        first.times *= 2
    second.steps, second.times = first.steps, first.times
    return first, second
