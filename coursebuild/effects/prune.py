"""Keeping the store within its limit: what was used least recently goes first.

Entry points: `prune_if_due`, `prune`, `remove_abandoned`.

Only files named by a hash are entries, and only they are counted and removed, with the temporary
files of writers that were killed. Other processes may write, read and prune meanwhile: whoever
misses an entry that was removed makes it again.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from coursebuild.effects.locks import is_abandoned

TEMPORARY = ".new-"
"""Names of files that are being written begin so."""
HASH = re.compile(r"[0-9a-f]{64}")
"""What an entry, or a group of them, is called."""
_STAMP = "pruned"
"""A file whose time of change says when the store was last gone through."""
_OFTEN = 3600.0
"""Seconds between two times."""
_SHARE = 16
"""Where this part of the limit was written at once the store is gone through at once."""
_ROOM = 0.9
"""Part of the limit that is left full, so that not every command has to remove something."""


class _File(Struct, frozen=True):
    used: float
    size: int
    path: str


def prune_if_due(folder: Path, limit: int, written: int) -> None:
    """Go through the store if that was not done lately, or much was written since."""
    stamp = folder / _STAMP
    with contextlib.suppress(OSError):
        age = time.time() - stamp.stat().st_mtime
        if 0.0 <= age < _OFTEN and written * _SHARE < limit:
            return
    with contextlib.suppress(OSError):
        stamp.touch()
        prune(folder, limit)


def prune(folder: Path, limit: int) -> int:
    """Remove entries until the rest takes at most `limit` bytes; gives how many were removed."""
    files = list(_entries(folder))
    total = sum(file.size for file in files)
    if total <= limit:
        return 0
    removed = 0
    for file in sorted(files, key=lambda file: (file.used, file.path)):
        if total <= limit * _ROOM:
            break
        total -= file.size
        with contextlib.suppress(OSError):
            os.unlink(file.path)  # noqa: PTH108 - ten thousand of them
            removed += 1
    return removed


def remove_abandoned(folder: Path) -> None:
    """Remove the temporary files in a folder whose writers were killed."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(TEMPORARY):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(entry.path)


def _entries(folder: Path) -> Iterator[_File]:
    """Every entry; on the way abandoned temporary files and empty groups are removed."""
    with os.scandir(folder) as kinds:
        for kind in kinds:
            if kind.is_dir(follow_symlinks=False):
                yield from _files(kind.path, groups=True)


def _files(folder: str, *, groups: bool) -> Iterator[_File]:
    empty = True
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            empty = False
            with contextlib.suppress(OSError):
                if entry.name.startswith(TEMPORARY):
                    _remove_if_abandoned(entry.path)
                elif not HASH.fullmatch(entry.name):
                    continue
                elif entry.is_file(follow_symlinks=False):
                    status = entry.stat(follow_symlinks=False)
                    yield _File(status.st_mtime, status.st_size, entry.path)
                elif groups and entry.is_dir(follow_symlinks=False):
                    yield from _files(entry.path, groups=False)
    if empty and not groups:
        with contextlib.suppress(OSError):  # somebody has written into it
            Path(folder).rmdir()


def _remove_if_abandoned(path: str) -> None:
    fd = os.open(path, os.O_RDWR | os.O_CLOEXEC | getattr(os, "O_NOFOLLOW", 0))
    try:
        if is_abandoned(fd):
            Path(path).unlink()
    finally:
        os.close(fd)
