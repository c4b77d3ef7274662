"""What long work says while it runs: a live line on a terminal, plain lines elsewhere.

Entry point: `Progress(stream, quiet=…)`. Everything goes to standard error, so that standard output
holds only results.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO


class Progress:
    """Says which stage runs, which scripts run, and how long they take.

    Safe to call from several threads.
    """

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.quiet = quiet
        self.live = not quiet and self.stream.isatty()
        self._lock = threading.Lock()
        self._running: dict[str, float] = {}
        self._stage = ""
        self._done = 0
        self._total = 0
        self._stop = threading.Event()

    @contextmanager
    def stage(self, name: str, total: int = 0) -> Iterator[None]:
        """A stage of the work; on a terminal its line is renewed while it runs."""
        self._stage, self._done, self._total = name, 0, total
        ticker = threading.Thread(target=self._tick, daemon=True) if self.live else None
        self._stop.clear()
        if ticker is not None:
            ticker.start()
        try:
            yield
        finally:
            self._stop.set()
            if ticker is not None:
                ticker.join()
                self._clear()
            with self._lock:
                self._running.clear()

    def started(self, name: str) -> None:
        """A script began."""
        with self._lock:
            self._running[name] = time.monotonic()

    def finished(self, name: str, verdict: str, seconds: float) -> None:
        """A script ended."""
        with self._lock:
            self._running.pop(name, None)
            self._done += 1
            if not self.quiet:
                self._clear()
                self._write(f"  {verdict:<8} {name}  {seconds:.2f} s\n")

    def say(self, text: str) -> None:
        """A line for the reader, unless quiet."""
        if not self.quiet:
            with self._lock:
                self._clear()
                self._write(text + "\n")

    def _tick(self) -> None:
        while not self._stop.wait(0.1):
            with self._lock:
                now = time.monotonic()
                names = [f"{name} {now - since:.0f} s" for name, since in self._running.items()]
                count = f" {self._done}/{self._total}" if self._total else ""
                line = f"{self._stage}{count}  {', '.join(names)}"
                self._write("\r\x1b[K" + line[: _columns() - 1])

    def _clear(self) -> None:
        if self.live:
            self._write("\r\x1b[K")

    def _write(self, text: str) -> None:
        try:
            self.stream.write(text)
            self.stream.flush()
        except (OSError, ValueError):  # nobody reads any more; the work goes on
            self.quiet, self.live = True, False


def _columns() -> int:
    import shutil

    return shutil.get_terminal_size().columns
