"""The state of a file or folder as a short text: the same text means the same content.

That of a file is its SHA-256, that of a folder a hash of the names in it; a path where nothing is
has the state `absent`.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import stat
import time
from collections.abc import Iterable
from pathlib import Path

from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import reason
from coursebuild.core.files.trust import make_store

ABSENT = "absent"
FOLDER = "folder"
FILE = "file"
SPECIAL = "special"
"""A device or a pipe: what will be read from it cannot be known."""
_TICK = 2_000_000_000
"""The coarsest clock of a file system, ns."""
_LAG = 20_000_000
"""How far the clock of a file system may lag behind, ns."""
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
        if max(times) + _TICK >= time.time_ns():  # another change might not show in its times
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
    """The SHA-256 of a file, remembered by its stat: large files are parts of many models."""
    return _sha256(path)


def folder_state(path: str) -> str:
    """The state of what should be a folder: the names in it, and which are folders."""
    try:
        with os.scandir(path) as entries:
            names = sorted((os.fsencode(e.name), e.is_dir()) for e in entries)
    except NotADirectoryError:
        return FILE
    except (FileNotFoundError, ValueError):
        return ABSENT
    except OSError as error:
        return f"unreadable: {reason(error)}"
    parts = (name + (b"/\0" if is_folder else b"\0") for name, is_folder in names)
    return hashlib.sha256(b"".join(parts)).hexdigest()


def modules_in(folder: str, names: Iterable[str]) -> str:
    """Return those of the names that are modules in the folder."""
    try:
        entries = frozenset(os.listdir(folder))  # noqa: PTH208
    except (OSError, ValueError):
        return ""
    return " ".join(
        name
        for name in names
        if f"{name}.py" in entries
        or (name in entries and Path(folder, name, "__init__.py").exists())
    )


class Clock:
    """The clock of the file system that holds the course, read by touching a file there.

    Where the store lies elsewhere, the system's clock has to do.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._path = store.folder / "clock"

    def now(self) -> int:
        """The time now, ns: every later change has this time or a later one."""
        with contextlib.suppress(OSError):
            if not self._store.set_aside:
                if not self._path.exists():
                    make_store(str(self._path.parent), str(self._store.root))
                self._path.touch()
                return self._path.stat().st_ctime_ns
        return time.time_ns() - _LAG

    def tick(self) -> None:
        """Wait until `now` gives a later time than all changes so far have."""
        before = self.now()
        until = time.monotonic() + _LONGEST_TICK
        while self.now() <= before and time.monotonic() < until:
            time.sleep(0.001)


def changed_since(path: str, since_ns: int) -> bool:
    """Whether a file or folder has changed since a time of a `Clock`, by its own times.

    Where nothing is at the path, the times of the nearest folder above it count.
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
    # The modification time can be set to anything, even to the future.
    return status.st_ctime_ns >= since_ns or since_ns <= status.st_mtime_ns <= time.time_ns()
