"""Turns events of the file system into saves, and saves into pages.

Entry point: `follow(session, watcher)`, which a thread of its own runs.

1. An editor may save in several steps: empty the file, then fill it; or write a new file, then move
   it to the place of the old one. They count as one save, which is complete when nothing has
   happened for some milliseconds.
2. For many files at once, as when a branch is switched, the wait is longer.
3. So it is for a file that is missing or empty, which may be so only between two steps.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

from coursebuild.preview.session import MAX_SINGLE_READS, Session
from coursebuild.preview.watcher import FolderWatcher

QUIET = 0.008
"""Seconds without an event after which a save is complete."""
QUIET_MANY = 0.060
"""The same where many files change."""
QUIET_GONE = 0.100
"""The same where a file is not there or empty."""
LONGEST = 0.250
"""Seconds after which a save is taken in any case; with many files, four times that."""


def follow(session: Session, watcher: FolderWatcher) -> None:
    """Take saves until the watcher is stopped.

    Each is printed, with the milliseconds from its first event until it was taken.
    """
    while not watcher.is_stopped:
        watcher.watch_also(session.files_elsewhere(), session.packages())
        paths = watcher.get(1.0)
        if not paths:
            continue
        began = time.monotonic()
        session.calm.clear()
        try:
            paths = _wait_until_complete(session.root, watcher, paths)
            has_changed = session.edit(paths)
            if has_changed is None:  # more than documents changed
                session.take_other_saves()
        finally:
            session.calm.set()
        if has_changed is not False:
            names = ", ".join(sorted(paths)[:3]) + (" …" if len(paths) > 3 else "")
            milliseconds = 1e3 * (time.monotonic() - began)
            session.options.progress.say(f"changed: {names} ({milliseconds:.0f} ms)")


def _wait_until_complete(
    root: Path, watcher: FolderWatcher, paths: frozenset[str]
) -> frozenset[str]:
    """Wait until a save is complete; return all its paths."""
    began = now = time.monotonic()
    while True:
        many = len(paths) > MAX_SINGLE_READS
        quiet = QUIET_MANY if many else QUIET_GONE if _is_any_empty(root, paths) else QUIET
        remaining = began + LONGEST * (4 if many else 1) - now
        later = watcher.get(min(quiet, remaining)) if remaining > 0 else frozenset()
        if not later:
            return paths
        paths |= later
        now = time.monotonic()


def _is_any_empty(root: Path, paths: Iterable[str]) -> bool:
    try:
        return any((root / path).stat().st_size == 0 for path in paths)
    except OSError:
        return True
