"""From events of the file system to saves, and from saves to pages.

Entry point: `follow(session, watcher, progress)`, which a thread of its own runs.

1. An editor may save in several steps: empty the file, then fill it; or write a new file, then put
   it in the place of the old one. They count as one save, which is complete when nothing has
   happened for some milliseconds.
2. Many files at once, as when a branch is switched, are waited for longer.
3. So is a file that is missing or empty, which it may be only between two steps.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

from coursebuild.pipeline.progress import Progress
from coursebuild.preview.session import MOST, Session
from coursebuild.preview.watcher import FolderWatcher

QUIET = 0.008
"""Seconds without an event after which a save is complete."""
QUIET_MANY = 0.060
"""The same where many files change."""
QUIET_GONE = 0.100
"""The same where a file is not there or empty."""
LONGEST = 0.250
"""Seconds after which a save is taken, whatever still happens; with many files, four times that."""


def follow(session: Session, watcher: FolderWatcher, progress: Progress) -> None:
    """Take saves until the watcher is stopped.

    Each is told, with the milliseconds from its first event until it was taken.
    """
    while not watcher.stopped:
        watcher.watch_also(session.files_elsewhere(), session.packages())
        paths = watcher.get(1.0)
        if not paths:
            continue
        began = time.monotonic()
        session.calm.clear()
        try:
            paths = _complete(session.root, watcher, paths)
            changed = session.edit(paths)
            if changed is None:  # more than documents changed
                session.take_others()
        finally:
            session.calm.set()
        if changed is not False:
            names = ", ".join(sorted(paths)[:3]) + (" …" if len(paths) > 3 else "")
            progress.say(f"changed: {names} ({1e3 * (time.monotonic() - began):.0f} ms)")


def _complete(root: Path, watcher: FolderWatcher, paths: frozenset[str]) -> frozenset[str]:
    """All paths of a save, once nothing more happens."""
    began = now = time.monotonic()
    while True:
        many = len(paths) > MOST
        quiet = QUIET_MANY if many else QUIET_GONE if _is_any_empty(root, paths) else QUIET
        left = began + LONGEST * (4 if many else 1) - now
        more = watcher.get(min(quiet, left)) if left > 0 else frozenset()
        if not more:
            return paths
        paths |= more
        now = time.monotonic()


def _is_any_empty(root: Path, paths: Iterable[str]) -> bool:
    try:
        return any((root / path).stat().st_size == 0 for path in paths)
    except OSError:
        return True
