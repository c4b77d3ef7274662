"""How the work that something takes grows with its size: there is no limit in seconds."""

from __future__ import annotations

import time
from collections.abc import Callable


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
