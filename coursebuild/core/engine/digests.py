"""What stands at a path now, as a short text: the same text, the same content.

Entry points: `Digests`; `changed_since` with a time of a `Clock`.

1. A file is its SHA-256, a folder the hash of what it lists, and what is not there is `absent`.
2. A file is read once and then again only when its size, its times or its inode differ: what was
   read is remembered in the store. A file changed a moment before it was read is not remembered,
   since a change within the same tick of the clock would not show in its times.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
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
_MOST = 200_000
_KIND, _KEY = "digests", hashlib.sha256(b"digests").hexdigest()

Signature = tuple[int, int, int, int, int]
"""Size, time of content, time of change (both ns), inode, device."""


class Digests:
    """The states of files and folders; not for several threads."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._known: dict[str, tuple[Signature, str]] | None = None
        self._seen: dict[str, tuple[Signature, str]] = {}
        self._is_new = False
        self._listed: dict[str, frozenset[str]] = {}

    def file(self, path: str) -> str:
        """The state of what should be a file, at an absolute path; links are followed."""
        try:
            status = os.stat(path)  # noqa: PTH116 - thousands of them
        except (FileNotFoundError, NotADirectoryError):
            return ABSENT
        except OSError as error:
            return f"unreadable: {reason(error)}"
        except ValueError:  # a null character
            return ABSENT
        if stat.S_ISDIR(status.st_mode):
            return FOLDER
        if not stat.S_ISREG(status.st_mode):
            return SPECIAL
        signature = _signature(status)
        known = self._seen.get(path) or self._loaded().get(path)
        if known is not None and known[0] == signature:
            self._seen[path] = known
            return known[1]
        return self._read(path)

    def folder(self, path: str) -> str:
        """The state of what should be a folder: the names in it, and which are folders."""
        digest = hashlib.sha256()
        try:
            with os.scandir(path) as entries:
                names = sorted((os.fsencode(e.name), e.is_dir()) for e in entries)
        except FileNotFoundError:
            return ABSENT
        except NotADirectoryError:
            return FILE
        except OSError as error:
            return f"unreadable: {reason(error)}"
        except ValueError:
            return ABSENT
        for name, is_folder in names:
            digest.update(name + (b"/\0" if is_folder else b"\0"))
        return digest.hexdigest()

    def modules(self, folder: str, names: Iterable[str]) -> str:
        """Which modules of these names a folder has."""
        if folder not in self._listed:
            try:
                self._listed[folder] = frozenset(os.listdir(folder))  # noqa: PTH208
            except (OSError, ValueError):
                self._listed[folder] = frozenset()
        listed = self._listed[folder]
        found = []
        for name in names:
            near = name in listed and self.file(f"{folder}/{name}/__init__.py") != ABSENT
            if near or f"{name}.py" in listed:
                found.append(name)
        return " ".join(found)

    def save(self) -> None:
        """Remember what was read, if there is anything new."""
        if not self._is_new:
            return
        self._is_new = False
        kept = {**self._loaded(), **self._seen}
        if len(kept) > _MOST:
            kept = dict(self._seen)
        self._store.put(_KIND, _KEY, json.dumps(kept).encode(), local=True)

    def _read(self, path: str) -> str:
        try:
            with open(path, "rb") as file:  # noqa: PTH123
                before = os.fstat(file.fileno())
                digest = hashlib.file_digest(file, "sha256").hexdigest()
                after = os.fstat(file.fileno())
        except (FileNotFoundError, NotADirectoryError):
            return ABSENT
        except OSError as error:
            return f"unreadable: {reason(error)}"
        signature = _signature(before)
        latest = max(before.st_mtime_ns, before.st_ctime_ns)
        # A time in the future says nothing of what happens until then.
        if signature == _signature(after) and latest + _TICK < time.time_ns():
            self._seen[path] = (signature, digest)
            self._is_new = True
        return digest

    def _loaded(self) -> dict[str, tuple[Signature, str]]:
        if self._known is None:
            self._known = {}
            found = self._store.peek(_KIND, _KEY)
            with contextlib.suppress(ValueError, TypeError, AttributeError, RecursionError):
                for path, (signature, digest) in json.loads(found or b"{}").items():
                    self._known[path] = (tuple(signature), digest)
        return self._known


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


def _signature(status: os.stat_result) -> Signature:
    return (status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino, status.st_dev)
