"""A course that follows its files: events of the file system become saves, and saves pages.

Entry point: `LiveCourse`. A thread of its own takes saves; the main thread does the rest of a build
(`rebuild`).

1. An editor may save in several steps: empty the file, then fill it; or write a new file, then move
   it to the place of the old one. They count as one save, which is complete when nothing has
   happened for some milliseconds.
2. For many files at once, as when a branch is switched, the wait is longer.
3. So it is for a file that is missing or empty, which may be so only between two steps.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn

from coursebuild.pipeline.options import Options
from coursebuild.preview.rebuild import BackgroundRebuild
from coursebuild.preview.session import MAX_SINGLE_READS, Session
from coursebuild.preview.watcher import FolderWatcher
from coursebuild.report import Style

QUIET = 0.008
"""Seconds without an event after which a save is complete."""
LONG_QUIET = 0.100
"""The same where more is to be expected: with many files, and with one that is gone or empty."""
LONGEST = 1.0
"""Seconds after which a save is taken in any case."""


class LiveCourse:
    """A course in memory that follows its files: what `serve` and `lsp` have in common."""

    def __init__(self, options: Options, style: Style, *, site: bool = True) -> None:
        """`style`: how mistakes are printed; `site`: whether pages are drawn."""
        self.session = Session(options, site=site)
        self._watcher = FolderWatcher(options.root)
        self._rebuild = BackgroundRebuild(self.session, style)

    def start(self) -> None:
        """Read the course, and follow its files from then on."""
        self.session.start()
        self._watcher.start()
        threading.Thread(target=self._take_saves, name="saves", daemon=True).start()

    def rebuild(self) -> NoReturn:
        """Do the rest of a build after each save; raise what fails, also while saves are taken."""
        self._rebuild.follow()

    def close(self) -> None:
        """End everything, the store included."""
        self._watcher.stop()
        self._rebuild.close()
        self.session.close()
        self.session.options.store.close()

    def _take_saves(self) -> None:
        while not self._watcher.is_stopped:
            try:
                self._watcher.watch_also(self.session.files_elsewhere(), self.session.packages())
                paths = self._watcher.get(1.0)
                if paths:
                    self._take_save(paths)
            except BaseException as error:  # raised again in the main thread
                self._rebuild.fail(error)

    def _take_save(self, paths: frozenset[str]) -> None:
        """Take a save that began with these paths.

        It is printed, with the milliseconds from its first event until it was taken.
        """
        began = time.monotonic()
        self.session.calm.clear()
        try:
            paths = _wait_until_complete(self.session.root, self._watcher, paths)
            has_changed = self.session.edit(paths)
            if has_changed is None:  # more than documents changed
                self.session.take_other_saves()
        finally:
            self.session.calm.set()
        if has_changed is not False:
            names = ", ".join(sorted(paths)[:3]) + (" …" if len(paths) > 3 else "")
            milliseconds = 1e3 * (time.monotonic() - began)
            self.session.options.progress.say(f"changed: {names} ({milliseconds:.0f} ms)")


def _wait_until_complete(
    root: Path, watcher: FolderWatcher, paths: frozenset[str]
) -> frozenset[str]:
    """Wait until a save is complete; return all its paths."""
    began = now = time.monotonic()
    while True:
        is_part = len(paths) > MAX_SINGLE_READS or _is_any_empty(root, paths)
        remaining = began + LONGEST - now
        later = watcher.get(min(LONG_QUIET if is_part else QUIET, remaining))
        if not later:
            return paths
        paths |= later
        now = time.monotonic()


def _is_any_empty(root: Path, paths: Iterable[str]) -> bool:
    try:
        return any((root / path).stat().st_size == 0 for path in paths)
    except OSError:
        return True
