"""Measures how work grows with size, for tests without limits in seconds."""

from __future__ import annotations

import time
from collections.abc import Callable


def processor_time_growth(action: Callable[[int], object], size: int) -> float:
    """Return the ratio of processor times at eight times the size: 8 if linear, 64 if quadratic."""

    def least(size: int) -> float:
        times = []
        for _ in range(3):
            start = time.process_time()
            action(size)
            times.append(time.process_time() - start)
        return min(times)

    return least(8 * size) / least(size)
