"""What long work says while it runs: a live line on a terminal, plain lines elsewhere.

Entry point: `Progress(stream, quiet=…)`. Everything goes to standard error, so that standard output
holds only results. What a script's verdict is belongs to the results, and is not said here.

1. On a terminal one line says what runs and for how long; it is renewed while the work goes on, and
   gone when it is done.
2. Elsewhere a line says what begins, and one for each script what it did and how long it took, so
   that a log shows where the time goes and what hangs.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from coursebuild.report.terminal import clipped

_RENEWED = 0.1
"""Seconds from one live line to the next."""
_ERASE = "\r\x1b[K"


class Progress:
    """Says which stage runs, which scripts run, and how long they take.

    Safe to call from several threads.
    """

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self.stream = sys.stderr if stream is None else stream
        # There is no standard error where the tool was started without one.
        self.quiet = quiet or self.stream is None
        self.live = not self.quiet and self.stream.isatty() and os.environ.get("TERM") != "dumb"
        self._lock = threading.Lock()
        self._running: dict[str, float] = {}
        self._doing: dict[str, str] = {}
        self._stage = ""
        self._told = ""
        self._since = 0.0
        self._done = 0
        self._total = 0
        self._stop = threading.Event()

    @contextmanager
    def stage(self, name: str, total: int = 0) -> Iterator[None]:
        """A stage of the work, with so many scripts to run."""
        self._stage, self._done, self._total, self._since = name, 0, total, time.monotonic()
        if not self.live:
            told = f"{name} ({total})" if total else name
            if told != self._told:  # it goes on with the next part of the same work
                self.say(told)
            self._told = told
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
                self._running.clear()

    def started(self, name: str) -> None:
        """A script began."""
        with self._lock:
            self._running[name] = time.monotonic()
            if not self.live:
                self._write(f"  {name}\n")

    def doing(self, name: str, what: str) -> None:
        """What something that runs is at; only a terminal is told."""
        with self._lock:
            self._doing[name] = what

    def known(self) -> None:
        """Something need not run: what it gives is kept."""
        with self._lock:
            self._done += 1

    def finished(self, name: str, verdict: str, seconds: float) -> None:
        """A script ended; the verdict is one word, such as `ok` or `timeout`."""
        with self._lock:
            self._running.pop(name, None)
            self._doing.pop(name, None)
            self._done += 1
            if not self.live:
                self._write(f"  {name}: {verdict} after {seconds:.2f} s\n")

    def say(self, text: str) -> None:
        """A line for the reader, unless quiet."""
        with self._lock:
            self._write(f"{_ERASE if self.live else ''}{text}\n")

    def _tick(self) -> None:
        while True:
            with self._lock:
                room = _columns(self.stream) - 1
                self._write(_ERASE + clipped(self._line(time.monotonic()), room))
            if self._stop.wait(_RENEWED):
                return

    def _line(self, now: float) -> str:
        if not self._total:
            return f"{self._stage}  {now - self._since:.0f} s"
        doing = {name: f" ({what})" for name, what in self._doing.items()}
        running = self._running.items()
        names = [f"{name}{doing.get(name, '')} {now - since:.0f} s" for name, since in running]
        return f"{self._stage} {self._done}/{self._total}  {', '.join(names)}"

    def _write(self, text: str) -> None:
        if self.quiet:
            return
        try:
            self.stream.write(text)
            self.stream.flush()
        except (OSError, ValueError):  # nobody reads any more; the work goes on
            self.quiet = True


def _columns(stream: TextIO) -> int:
    """The width of a terminal; 80 where it does not know its own."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or 80
    except (OSError, ValueError):
        return 80
