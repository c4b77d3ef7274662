"""How the work that something takes grows with its size: there is no limit in seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import FrameType
from typing import TypeVar

Result = TypeVar("Result")


def counted(action: Callable[[], Result]) -> tuple[int, Result]:
    """How many functions are called and left while something is done, and what it gives."""
    count = 0

    def count_one(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += 1

    sys.setprofile(count_one)
    try:
        result = action()
    finally:
        sys.setprofile(None)
    return count, result


def grows_in_proportion(action: Callable[[int], Result], size: int) -> Result:
    """Assert that twice the size takes about twice the work; gives what the larger one gave."""
    once, _ = counted(lambda: action(size))
    twice, result = counted(lambda: action(2 * size))
    assert twice < 2.4 * once + 2000, f"{once} calls for {size}, {twice} for twice that"
    return result


def processor_time_growth(action: Callable[[int], object], size: int) -> float:
    """How often the processor time of a size that of eight times it is: 8, or 64 for a square."""

    def least(size: int) -> float:
        times = []
        for _ in range(3):
            start = time.process_time()
            action(size)
            times.append(time.process_time() - start)
        return min(times)

    return least(8 * size) / least(size)
