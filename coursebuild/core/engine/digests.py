"""What stands at a path now, as a short text: the same text, the same content.

Entry points: `file_state`, `folder_state`, `modules_in`; `changed_since` with a time of a `Clock`.

A file is its SHA-256, a folder the hash of what it lists, and what is not there is `absent`.
"""

from __future__ import annotations

import functools
import hashlib
import os
import stat
import time
from collections.abc import Iterable
from pathlib import Path

from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.errors import reason
from coursebuild.core.files.locks import make_private_folder

ABSENT = "absent"
FOLDER = "folder"
FILE = "file"
SPECIAL = "special"
"""A device or a pipe: what it gives cannot be known beforehand."""
_TICK = 2_000_000_000
"""The coarsest clock of a file system, ns."""
_LAG = 20_000_000
"""How far the clock of a file system may be behind, ns."""
_LONGEST_TICK = 0.05


def file_state(path: str) -> str:
    """The state of what should be a file, at an absolute path; links are followed."""
    try:
        status = os.stat(path)  # noqa: PTH116 - thousands of them
        if stat.S_ISDIR(status.st_mode):
            return FOLDER
        if not stat.S_ISREG(status.st_mode):
            return SPECIAL
        times = status.st_mtime_ns, status.st_ctime_ns
        if max(times) + _TICK >= time.time_ns():  # another change may not show in its times
            return _sha256(path)
        return _known_sha256(path, (*times, status.st_size, status.st_ino, status.st_dev))
    except (FileNotFoundError, NotADirectoryError, ValueError):  # the last: a null character
        return ABSENT
    except OSError as error:
        return f"unreadable: {reason(error)}"


def _sha256(path: str) -> str:
    with open(path, "rb") as file:  # noqa: PTH123
        return hashlib.file_digest(file, "sha256").hexdigest()


@functools.lru_cache(maxsize=10_000)
def _known_sha256(path: str, signature: tuple[int, ...]) -> str:
    """That of a file with these times, this size and place: large ones are parts of many models."""
    return _sha256(path)


def folder_state(path: str) -> str:
    """The state of what should be a folder: the names in it, and which are folders."""
    digest = hashlib.sha256()
    try:
        with os.scandir(path) as entries:
            names = sorted((os.fsencode(e.name), e.is_dir()) for e in entries)
    except NotADirectoryError:
        return FILE
    except (FileNotFoundError, ValueError):
        return ABSENT
    except OSError as error:
        return f"unreadable: {reason(error)}"
    for name, is_folder in names:
        digest.update(name + (b"/\0" if is_folder else b"\0"))
    return digest.hexdigest()


def modules_in(folder: str, names: Iterable[str]) -> str:
    """Which modules of these names a folder has."""
    try:
        listed = frozenset(os.listdir(folder))  # noqa: PTH208
    except (OSError, ValueError):
        return ""
    return " ".join(
        name
        for name in names
        if f"{name}.py" in listed or (name in listed and Path(folder, name, "__init__.py").exists())
    )


class Clock:
    """The clock of the file system that the course lies on: a file in the store is touched."""

    def __init__(self, store: Memo) -> None:
        self._path = store.folder / "clock"

    def now(self) -> int:
        """A time, ns: what changes from now on has this time or a later one."""
        try:
            if not self._path.exists():
                make_private_folder(self._path.parent)
            self._path.touch()
            return self._path.stat().st_ctime_ns
        except OSError:
            return time.time_ns() - _LAG

    def tick(self) -> None:
        """Wait until what has changed before has an earlier time than `now` gives."""
        before = self.now()
        until = time.monotonic() + _LONGEST_TICK
        while self.now() <= before and time.monotonic() < until:
            time.sleep(0.001)


def changed_since(path: str, since_ns: int) -> bool:
    """Whether a file or folder has changed since a time of a `Clock`, by its own times.

    Of what is not there the folder counts in which it would be.
    """
    place = Path(path)
    while True:
        try:
            status = place.stat()
            break
        except (OSError, ValueError):
            if place == place.parent:
                return False
            place = place.parent
    # The time of content can be set to anything, also to a moment that is to come.
    return status.st_ctime_ns >= since_ns or since_ns <= status.st_mtime_ns <= time.time_ns()
