"""Waiting for the author to save: changes of the course's files.

Entry point: `watcher`. What reading a course leaves out (caches, editors' own files) is no change.

The folders of the course are watched with all that is in them. Pages may lie elsewhere
(`docs/guide.md`, `README.md`): of their folders only these files count. Folders that are made later
are watched from then on.

Linux is asked itself (`watch_inotify`): it says at once what happened, and when a file that was
written is closed. Elsewhere, and where its messages do not come, `watchfiles` is asked.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Protocol


class Watcher(Protocol):
    """Tells of saves, also of those while the caller does something else."""

    def start(self) -> None:
        """Begin to watch; `wait` says when nothing is missed any more."""

    def wait(self) -> None:
        """Until no change is missed."""

    @property
    def stopped(self) -> bool:
        """Whether it was stopped."""

    def stop(self) -> None:
        """Watch no longer."""

    def watch_also(self, paths: frozenset[str]) -> None:
        """Files elsewhere that count as well, by POSIX path relative to the course's folder."""

    def get(self, seconds: float) -> frozenset[str]:
        """Paths that changed, POSIX and relative to the root; empty where there is nothing new.

        Waits for so long.

        Raises:
            EffectError: changes cannot be watched.
        """

    exact: bool
    """Whether `writing` says so of every file: what is not being written then is complete."""

    @property
    def writing(self) -> bool:
        """Whether something that `get` has told of is known to be not written to its end yet."""


def watcher(root: Path) -> Watcher:
    """What watches a course best on this machine."""
    if _inotify_is_enough():
        from coursebuild.effects.watch_inotify import InotifyWatcher

        return InotifyWatcher(root)
    from coursebuild.effects.watch_files import FilesWatcher

    return FilesWatcher(root)


def _inotify_is_enough() -> bool:
    """Whether this is a Linux whose kernel sees every save: one inside of Windows does not.

    Who has `watchfiles` look for changes itself knows why.
    """
    if sys.platform != "linux" or os.environ.get("WATCHFILES_FORCE_POLLING"):
        return False
    return "microsoft" not in os.uname().release.lower()
