"""Messages about long work while it runs: a live line on a terminal, plain lines elsewhere.

Everything goes to standard error, so that standard output holds only results. Elsewhere than on a
terminal, lines for each script show in a log where the time goes and what hangs.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from coursebuild.report.text import clip

_INTERVAL = 0.1
"""Seconds between updates of the live line."""
_LONG = 1.0
"""Seconds from which on it is worth saying how long a script took the last time."""
_ERASE = "\r\x1b[K"


class Progress:
    """Says which stage runs, which scripts run, and how long they take.

    Safe to call from several threads.
    """

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.quiet = quiet
        # The tool may have been started without a standard error.
        self._has_readers = not quiet and self.stream is not None
        self.live = self._has_readers and self.stream.isatty() and os.environ.get("TERM") != "dumb"
        self._lock = threading.Lock()
        self._running_since: dict[str, float] = {}
        self._last_seconds: dict[str, float | None] = {}
        self._activities: dict[str, str] = {}
        self._stage = ""
        self._last_line = ""
        self._since = 0.0
        self._ended_count = 0
        self._total = 0
        self._stop = threading.Event()

    @contextmanager
    def stage(self, name: str, total: int = 0) -> Iterator[None]:
        """Show a stage of the work, in which `total` scripts run."""
        self._stage, self._ended_count, self._total, self._since = name, 0, total, time.monotonic()
        if not self.live:
            line = f"{name} ({total})" if total else name
            if line != self._last_line:  # else it is the next part of the same work
                self.say(line)
            self._last_line = line
            yield
            return
        self._stop.clear()
        ticker = threading.Thread(target=self._tick, name="progress", daemon=True)
        ticker.start()
        try:
            yield
        finally:
            self._stop.set()
            ticker.join()
            with self._lock:
                self._write(_ERASE)
                self._running_since.clear()

    def start(self, name: str, last_seconds: float | None = None) -> None:
        """Show that a script runs; `last_seconds` is how long it took the last time."""
        with self._lock:
            self._running_since[name] = time.monotonic()
            self._last_seconds[name] = last_seconds
            if not self.live:
                is_long = last_seconds is not None and last_seconds >= _LONG
                time_text = f" ({last_seconds:.0f} s the last time)" if is_long else ""
                self._write(f"  {name}{time_text}\n")

    def describe(self, name: str, activity: str) -> None:
        """Show what something that runs is doing; only on a terminal."""
        with self._lock:
            self._activities[name] = activity

    def skip(self) -> None:
        """Count something that need not run, since its result is stored."""
        with self._lock:
            self._ended_count += 1

    def finish(self, name: str, verdict: str, seconds: float) -> None:
        """Show that a script ended; the verdict is one word, such as `ok` or `timeout`."""
        with self._lock:
            self._running_since.pop(name, None)
            self._activities.pop(name, None)
            self._ended_count += 1
            if not self.live:
                self._write(f"  {name}: {verdict} after {seconds:.2f} s\n")

    def say(self, text: str) -> None:
        """Print a line, unless quiet."""
        with self._lock:
            self._write(f"{_ERASE if self.live else ''}{text}\n")

    def _tick(self) -> None:
        while True:
            with self._lock:
                try:
                    columns = os.get_terminal_size(self.stream.fileno()).columns or 80
                except (OSError, ValueError):
                    columns = 80
                self._write(_ERASE + clip(self._line(time.monotonic()), columns - 1))
            if self._stop.wait(_INTERVAL):
                return

    def _line(self, now: float) -> str:
        if not self._total:
            return f"{self._stage}  {now - self._since:.0f} s"
        activities = {name: f" ({activity})" for name, activity in self._activities.items()}

        def times(name: str, seconds: float) -> str:
            last = self._last_seconds.get(name)
            if last is None or last < _LONG:
                return f"{seconds:.0f} s"
            left = f"{last - seconds:.0f} s left, " if seconds < last else ""
            return f"{seconds:.0f} s ({left}{last:.0f} s the last time)"

        names = [
            f"{name}{activities.get(name, '')} {times(name, now - since)}"
            for name, since in self._running_since.items()
        ]
        return f"{self._stage} {self._ended_count}/{self._total}  {', '.join(names)}"

    def _write(self, text: str) -> None:
        if not self._has_readers:
            return
        try:
            self.stream.write(text)
            self.stream.flush()
        except (OSError, ValueError):  # nobody reads any more; the work goes on
            self._has_readers = False
