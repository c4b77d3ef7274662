"""Results that are expensive to make and depend on nothing but their key, kept in `.coursebuild/`.

Entry point: `Memo`, with `get` and `put`, or both in one, `get_or_create`; `get_value` and
`put_value` for JSON.

1. An entry lies at `.coursebuild/KIND/KEY`, or `KIND/GROUP/KEY` where several results belong
   together. It is sealed under its name with the user's key (see `core.files.trust`), and the
   reader says which type the data must have. What somebody else wrote, or damaged, is not there.
2. It is written under a temporary name and then renamed, so that other processes see whole entries
   only.
3. Results of scripts and trials can be shared: they are also looked for in the shared cache, if
   there is one, and sent there. Everything else is made on this machine.
4. Now and then, as a command ends, the entries used longest ago are removed until the rest is
   within the limit.

Nothing is lost when the folder is deleted.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import msgspec

from coursebuild.core.files.errors import reason
from coursebuild.core.files.trust import (
    FOLDER,
    TEMPORARY,
    find_store,
    make_store,
    replace_file,
    seal,
    store_key,
    unseal,
)
from coursebuild.core.values import DAMAGE

if TYPE_CHECKING:
    from coursebuild.core.engine.shared_cache import SharedCache

Value = TypeVar("Value")

SIZE = 1 << 30
"""Bytes that all entries may take together."""
HASH = re.compile(r"[0-9a-f]{64}")
"""The name of an entry or of a group of entries."""
_USE_INTERVAL = 3600.0
"""Seconds after which the use of an entry is noted again, and a killed writer's file is removed."""
_PRUNE_INTERVAL = 3600.0
"""Seconds between two prunings."""
_PRUNE_SHARE = 16
"""A command that wrote this part of the limit, a sixteenth, prunes whatever the interval."""
_GROUP_SIZE = 8
"""Entries that a group keeps, the newest."""
_PRUNED_SHARE = 0.9
"""Part of the limit that pruning leaves in use, so that not every command has to prune."""


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
        folder, self.set_aside = find_store(str(root))
        """Why the folder `.coursebuild` of the course is not used; mostly empty."""
        self.folder = Path(folder)
        self.root = root
        self._key = store_key(str(root))
        self.shared = shared
        self.size = size
        self.fresh = fresh
        """Whether everything is to be made again: `get` finds nothing, `put` works as usual."""
        self._lock = threading.Lock()
        self._messages: set[str] = set()
        self._pending: list[str] = []
        self._tell: Callable[[str], None] = self._pending.append
        self._bytes_written = 0
        if shared is not None:
            shared.tell = self._say

    def listen(self, tell: Callable[[str], None]) -> None:
        """Send messages about the store to `tell`, a line each, earlier ones included."""
        with self._lock:
            self._tell = tell
            pending, self._pending = self._pending, []
        for line in pending:
            tell(line)

    def get_or_create(self, kind: str, key: str, make: Callable[[], bytes]) -> bytes:
        """The result of this kind and key: the one kept, or one made and kept now."""
        data = self.get(kind, key, bytes)
        if data is not None:
            return data
        data = make()
        if self.fresh:
            before = self.peek(kind, key, bytes)
            if before is not None and before != data:
                self._say(f"{_short(f'{kind}/{key}')} was made again and is not what was kept")
        self.put(kind, key, data)
        return data

    def get(
        self, kind: str, key: str, read: Callable[[bytes], Value | None], *, shared: bool = False
    ) -> Value | None:
        """The result of this kind and key, if an undamaged one is kept.

        `read` makes the result from its bytes; if it raises one of `DAMAGE` or returns `None`, the
        entry is damaged. A `shared` result is looked for in the shared cache too.
        """
        if self.fresh:
            return None
        value = self.peek(kind, key, read)
        if value is None and self.shared is not None and shared:
            value = self._fetch(self.shared, f"{kind}/{key}", read)
        return value

    def peek(self, kind: str, key: str, read: Callable[[bytes], Value | None]) -> Value | None:
        """What this machine keeps under a key, even if everything is to be made again."""
        name = f"{kind}/{key}"
        path = f"{self.folder}/{name}"
        try:
            with open(path, "rb", buffering=0) as file:  # noqa: PTH123 - there are many
                modified = os.fstat(file.fileno()).st_mtime
                entry = file.read()
        except OSError:
            return None
        value = _value(unseal(name, entry, self._key), read)
        if value is not None and time.time() - modified > _USE_INTERVAL:
            with contextlib.suppress(OSError):
                os.utime(path)  # entries used lately are pruned last
        return value

    def put(self, kind: str, key: str, data: bytes, *, shared: bool = False) -> None:
        """Keep a result, if `shared` also in the shared cache; failing to only costs time."""
        name = f"{kind}/{key}"
        self._write(name, data)
        if self.shared is not None and shared:
            self.shared.write(name, seal(name, data, self.shared.key))

    def get_value(self, kind: str, key: str, type: type[Value]) -> Value | None:
        """A result that was kept as JSON, if it is of this type."""
        return self.get(kind, key, functools.partial(msgspec.json.decode, type=type))

    def put_value(self, kind: str, key: str, value: object) -> None:
        """Keep a value as JSON."""
        self.put(kind, key, msgspec.json.encode(value))

    def group(self, kind: str, key: str) -> list[str]:
        """Return the keys `GROUP/KEY` of a group, newest first, and remove all but the newest."""
        folder = self.folder / kind / key
        entries: list[tuple[float, str]] = []
        with contextlib.suppress(OSError), os.scandir(folder) as files:
            entries = [(f.stat().st_mtime, f.name) for f in files if not f.name.startswith(".")]
        entries.sort(reverse=True)
        for _, name in entries[_GROUP_SIZE:]:
            (folder / name).unlink(missing_ok=True)
        return [f"{key}/{name}" for _, name in entries[:_GROUP_SIZE]]

    def shared_group(self, kind: str, key: str) -> list[str]:
        """The keys of a group that the shared cache has."""
        if self.shared is None or self.fresh:
            return []
        names = sorted(self.shared.names(f"{kind}/{key}"))
        return [f"{key}/{name}" for name in names if HASH.fullmatch(name)]

    def close(self) -> None:
        """Wait until the shared cache has all new results, and keep this one within its limit."""
        if self.shared is not None:
            self.shared.flush()
        if self._bytes_written:
            with contextlib.suppress(OSError):
                self._prune_if_due()
            self._bytes_written = 0

    def _prune_if_due(self) -> None:
        """Prune if that was not done lately, or if much was written since."""
        marker = self.folder / "pruned"
        with contextlib.suppress(FileNotFoundError):
            age = time.time() - marker.stat().st_mtime
            if 0.0 <= age < _PRUNE_INTERVAL and self._bytes_written * _PRUNE_SHARE < self.size:
                return
        marker.touch()
        prune(self.folder, self.size)

    def _say(self, line: str) -> None:
        """Send a message, unless it was sent before."""
        with self._lock:
            if line in self._messages:
                return
            self._messages.add(line)
            tell = self._tell
        tell(line)

    def _fetch(
        self, shared: SharedCache, name: str, read: Callable[[bytes], Value | None]
    ) -> Value | None:
        entry = shared.read(name)
        if entry is None:
            return None
        data = unseal(name, entry, shared.key)
        value = _value(data, read)
        if data is None or value is None:
            self._say(f"{_short(name)} in the shared cache is damaged: it is made again")
        else:
            self._write(name, data)
        return value

    def _write(self, name: str, data: bytes) -> None:
        path, entry = self.folder / name, seal(name, data, self._key)
        try:
            try:
                replace_file(str(path), entry)
            except FileNotFoundError:
                make_store(str(self.folder), str(self.root))
                path.parent.mkdir(parents=True, exist_ok=True)
                replace_file(str(path), entry)
        except OSError as error:
            if self._key:  # else it was said at the beginning
                self._say(f"results cannot be kept in {FOLDER}: {reason(error)}")
            return
        with self._lock:
            self._bytes_written += len(entry)


def _value(data: bytes | None, read: Callable[[bytes], Value | None]) -> Value | None:
    """The result that an entry's data holds; `None` where the data is missing or damaged."""
    try:
        return None if data is None else read(data)
    except DAMAGE:
        return None


def _short(name: str) -> str:
    """An entry's name in messages."""
    kind, _, key = name.partition("/")
    return f"the entry {kind}/{key[:12]}…" if len(key) > 12 else f"the entry {name}"


# --- the limit


def prune(folder: Path, limit: int) -> None:
    """Remove the entries used longest ago until the rest takes at most `limit` bytes.

    Only files named by a hash are entries. Other processes may write, read and prune meanwhile:
    one that misses a removed entry makes it again.
    """
    with os.scandir(folder) as entries:
        kinds = [kind.path for kind in entries if kind.is_dir(follow_symlinks=False)]
    files = sorted(file for kind in kinds for file in _entries(kind, time.time() - _USE_INTERVAL))
    total = sum(size for _, _, size in files)
    enough = limit if total <= limit else limit * _PRUNED_SHARE
    for _, path, size in files:
        if total <= enough:
            break
        total -= size
        with contextlib.suppress(OSError):
            os.unlink(path)  # noqa: PTH108 - ten thousand of them


def _entries(folder: str, long_ago: float) -> Iterator[tuple[float, str, int]]:
    """The entries in a folder: when each was used last, its path and its size.

    Temporary files that a killed writer left before `long_ago` are removed.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as files:
        for entry in files:
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
