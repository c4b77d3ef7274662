"""Results that are expensive to make and depend on nothing but their key, kept in `.coursebuild/`.

Entry point: `Memo`: `get` and `put`, or both in one, `get_or_create`; `get_value` and `put_value`
of JSON.

1. An entry lies at `.coursebuild/KIND/KEY`, or `KIND/GROUP/KEY` where several results belong
   together. It begins with a hash of its name and its data, and whoever reads it says of which type
   the data must be. A damaged entry is reported, removed and made again.
2. It is written beside its place and renamed there, so that other processes see whole entries only.
3. Results of scripts and trials can be shared: they are also looked for in the shared cache, if
   there is one, and sent there. Everything else is made on this machine.
4. Now and then, as a command ends, entries are removed until all take less than the limit, those
   first that were used longest ago.

Nothing is lost when the folder is deleted.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import hmac
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import msgspec

from coursebuild.core.files.errors import reason
from coursebuild.core.files.locks import make_private_folder
from coursebuild.core.values import DAMAGE

if TYPE_CHECKING:
    from coursebuild.core.engine.shared_cache import SharedCache

Value = TypeVar("Value")

FOLDER = ".coursebuild"
SIZE = 1 << 30
"""Bytes that all may take."""
HASH = re.compile(r"[0-9a-f]{64}")
"""What an entry, or a group of them, is called."""
TEMPORARY = ".new-"
"""Names of files that are being written begin so."""
_DIGEST = hashlib.sha256().digest_size
_USED = 3600.0
"""Seconds after which the use of an entry is noted again, and what a killed writer left goes."""
_OFTEN = 3600.0
"""Seconds between two times that all is gone through."""
_SHARE = 16
"""Where this part of the limit was written at once all is gone through at once."""
_NEWEST = 8
"""Entries that a group keeps."""
_ROOM = 0.9
"""Part of the limit that is left full, so that not every command has to remove something."""


def replace_file(path: Path, data: bytes) -> None:
    """Write a file in a folder that is there, or write it anew: whole or not at all."""
    new = path.with_name(f"{TEMPORARY}{os.urandom(8).hex()}")
    try:
        new.write_bytes(data)
        new.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            new.unlink()
        raise


def sealed(name: str, data: bytes, key: bytes = b"") -> bytes:
    """An entry: data behind the hash of itself and its name, such as `KIND/KEY`.

    With a key only those who have it can make one.
    """
    text = b"%s\0%s" % (name.encode(), data)
    return (hmac.digest(key, text, "sha256") if key else hashlib.sha256(text).digest()) + data


def unsealed(name: str, entry: bytes, key: bytes = b"") -> bytes | None:
    """The data of an entry; `None` where it is not what was put under this name."""
    data = entry[_DIGEST:]
    return data if hmac.compare_digest(entry, sealed(name, data, key)) else None


class Memo:
    """The results kept for a course, here and perhaps in a shared cache.

    Safe to use from several threads, and from several processes on the same folder.
    """

    def __init__(
        self,
        root: Path,
        *,
        shared: SharedCache | None = None,
        size: int = SIZE,
        fresh: bool = False,
    ) -> None:
        self.folder = root / FOLDER
        self.shared = shared
        self.size = size
        self.fresh = fresh
        """Whether everything is to be made again: nothing is found, and what is made is kept."""
        self._lock = threading.Lock()
        self._told: set[str] = set()
        self._waiting: list[str] = []
        self._tell: Callable[[str], None] = self._waiting.append
        self._written = 0
        if shared is not None:
            shared.tell = self._say

    def listen(self, tell: Callable[[str], None]) -> None:
        """Be told what is wrong with entries, a line each; also what was found before."""
        with self._lock:
            self._tell = tell
            waiting, self._waiting = self._waiting, []
        for line in waiting:
            tell(line)

    def get_or_create(self, kind: str, key: str, make: Callable[[], bytes]) -> bytes:
        """The result of this kind and key: one that is kept, or made now and kept."""
        found = self.get(kind, key, bytes)
        if found is not None:
            return found
        made = make()
        if self.fresh:
            before = self.peek(kind, key, bytes)
            if before is not None and before != made:
                self._say(f"{_short(f'{kind}/{key}')} was made again and is not what was kept")
        self.put(kind, key, made)
        return made

    def get(
        self, kind: str, key: str, read: Callable[[bytes], Value | None], *, shared: bool = False
    ) -> Value | None:
        """The result of this kind and key, if it is kept and whole.

        `read` makes the result of its bytes; what it raises, or `None`, means that they hold none.
        A `shared` one is looked for in the shared cache too.
        """
        if self.fresh:
            return None
        found = self.peek(kind, key, read)
        if found is None and self.shared is not None and shared:
            found = self._fetch(self.shared, f"{kind}/{key}", read)
        return found

    def peek(self, kind: str, key: str, read: Callable[[bytes], Value | None]) -> Value | None:
        """What this machine keeps under a key, though everything is to be made again."""
        name = f"{kind}/{key}"
        path = f"{self.folder}/{name}"
        try:
            with open(path, "rb", buffering=0) as file:  # noqa: PTH123 - there are many
                changed = os.fstat(file.fileno()).st_mtime
                entry = file.read()
        except OSError:
            return None
        value = _value(unsealed(name, entry), read)
        with contextlib.suppress(OSError):
            if value is None:
                os.unlink(path)  # noqa: PTH108
                self._say(f"{_short(name)} in {FOLDER} is damaged: it is made again")
            elif time.time() - changed > _USED:
                os.utime(path)  # what was used lately stays
        return value

    def put(self, kind: str, key: str, data: bytes, *, shared: bool = False) -> None:
        """Keep a result, here or also in the shared cache; that it cannot be only costs time."""
        name = f"{kind}/{key}"
        self._write(name, data)
        if self.shared is not None and shared:
            self.shared.write(name, sealed(name, data, self.shared.key))

    def get_value(self, kind: str, key: str, type: type[Value]) -> Value | None:
        """A result that was kept as JSON, if it is of this type."""
        return self.get(kind, key, functools.partial(msgspec.json.decode, type=type))

    def put_value(self, kind: str, key: str, value: object) -> None:
        """Keep a value as JSON."""
        self.put(kind, key, msgspec.json.encode(value))

    def group(self, kind: str, key: str) -> list[str]:
        """The keys, `GROUP/KEY`, of the newest entries in a group, newest first; the others go."""
        folder = self.folder / kind / key
        found: list[tuple[float, str]] = []
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            found = [(e.stat().st_mtime, e.name) for e in entries if not e.name.startswith(".")]
        found.sort(reverse=True)
        for _, name in found[_NEWEST:]:
            (folder / name).unlink(missing_ok=True)
        return [f"{key}/{name}" for _, name in found[:_NEWEST]]

    def shared_group(self, kind: str, key: str) -> list[str]:
        """The keys of a group that the shared cache has."""
        if self.shared is None or self.fresh:
            return []
        names = sorted(self.shared.names(f"{kind}/{key}"))
        return [f"{key}/{name}" for name in names if HASH.fullmatch(name)]

    def close(self) -> None:
        """Wait until the shared cache has what was made, and keep all within the limit."""
        if self.shared is not None:
            self.shared.flush()
        if self._written:
            with contextlib.suppress(OSError):
                self._prune_if_due()
            self._written = 0

    def _prune_if_due(self) -> None:
        """Go through all if that was not done lately, or much was written since."""
        noted = self.folder / "pruned"
        with contextlib.suppress(FileNotFoundError):
            age = time.time() - noted.stat().st_mtime
            if 0.0 <= age < _OFTEN and self._written * _SHARE < self.size:
                return
        noted.touch()
        prune(self.folder, self.size)

    def _say(self, line: str) -> None:
        """Tell of something once."""
        with self._lock:
            if line in self._told:
                return
            self._told.add(line)
            tell = self._tell
        tell(line)

    def _fetch(
        self, shared: SharedCache, name: str, read: Callable[[bytes], Value | None]
    ) -> Value | None:
        entry = shared.read(name)
        if entry is None:
            return None
        data = unsealed(name, entry, shared.key)
        value = _value(data, read)
        if data is None or value is None:
            self._say(f"{_short(name)} in the shared cache is damaged: it is made again")
        else:
            self._write(name, data)
        return value

    def _write(self, name: str, data: bytes) -> None:
        path, entry = self.folder / name, sealed(name, data)
        try:
            try:
                replace_file(path, entry)
            except FileNotFoundError:
                make_private_folder(self.folder)
                path.parent.mkdir(parents=True, exist_ok=True)
                replace_file(path, entry)
        except OSError as error:
            self._say(f"results cannot be kept in {FOLDER}: {reason(error)}")
            return
        with self._lock:
            self._written += len(entry)


def _value(data: bytes | None, read: Callable[[bytes], Value | None]) -> Value | None:
    """What the data of an entry holds; `None` where it is not what it should be."""
    try:
        return None if data is None else read(data)
    except DAMAGE:
        return None


def _short(name: str) -> str:
    """An entry as people are told of it."""
    kind, _, key = name.partition("/")
    return f"the entry {kind}/{key[:12]}…" if len(key) > 12 else f"the entry {name}"


# --- the limit


def prune(folder: Path, limit: int) -> None:
    """Remove entries until the rest takes at most `limit` bytes: those first that were used first.

    Only files named by a hash are entries. Other processes may write, read and prune meanwhile:
    whoever misses an entry that was removed makes it again.
    """
    with os.scandir(folder) as found:
        kinds = [kind.path for kind in found if kind.is_dir(follow_symlinks=False)]
    files = sorted(file for kind in kinds for file in _entries(kind, time.time() - _USED))
    total = sum(size for _, _, size in files)
    enough = limit if total <= limit else limit * _ROOM
    for _, path, size in files:
        if total <= enough:
            break
        total -= size
        with contextlib.suppress(OSError):
            os.unlink(path)  # noqa: PTH108 - ten thousand of them


def _entries(folder: str, long_ago: float) -> Iterator[tuple[float, str, int]]:
    """The entries in a folder: when each was used last, its path and its size.

    What a writer that was killed `long_ago` left there goes.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as found:
        for entry in found:
            if entry.is_dir(follow_symlinks=False) and HASH.fullmatch(entry.name):
                yield from _entries(entry.path, long_ago)
                with contextlib.suppress(OSError):  # it is not empty
                    os.rmdir(entry.path)  # noqa: PTH106
            elif entry.is_file(follow_symlinks=False):
                status = entry.stat(follow_symlinks=False)
                if HASH.fullmatch(entry.name):
                    yield status.st_mtime, entry.path, status.st_size
                elif entry.name.startswith(TEMPORARY) and status.st_mtime < long_ago:
                    os.unlink(entry.path)  # noqa: PTH108
