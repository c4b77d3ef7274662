"""Looking again and again until something has happened."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path


def wait_until(happened: Callable[[], object], event: str) -> None:
    """Look again and again; what takes five minutes hangs."""
    until = time.monotonic() + 300
    while not happened():
        assert time.monotonic() < until, f"this never came: {event}"
        time.sleep(0.005)


def wait_for_file(path: Path, size: int = 0) -> None:
    wait_until(lambda: path.exists() and path.stat().st_size >= size, str(path))
