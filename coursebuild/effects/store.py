"""Results that are expensive to make and depend on nothing but their key, kept in `.coursebuild/`.

Entry points: `Store.kept(kind, key, make)`; `Store.load` and `Store.keep`, its two halves.

1. An entry lies at `.coursebuild/KIND/KEY`, or `KIND/GROUP/KEY` where several results belong
   together. It begins with the hash of its name and of what follows: one that was cut, flipped or
   put under another name is told of, removed, and made again instead of served.
2. It is written beside its place and renamed there, so that processes at work at the same time see
   whole entries only.
3. What is not there is looked for in the shared cache (`shared`), if there is one, and what is made
   is sent there.
4. When a command ends, now and then, what was not used for longest is removed until the store is
   smaller than its limit (`prune`).

Nothing is lost when the folder is deleted.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from coursebuild.effects.errors import reason
from coursebuild.effects.locks import make_private_folder, try_lock
from coursebuild.effects.prune import HASH, TEMPORARY, prune_if_due, remove_abandoned

if TYPE_CHECKING:
    from coursebuild.effects.shared import SharedCache

FOLDER = ".coursebuild"
SIZE = 1 << 30
"""Bytes that a store may take."""
_DIGEST = hashlib.sha256().digest_size
_USED = 3600.0
"""Seconds after which the use of an entry is noted again."""


def sealed(name: str, data: bytes) -> bytes:
    """An entry: data behind the hash of itself and its name, such as `KIND/KEY`."""
    return _seal(name, data) + data


def unsealed(name: str, entry: bytes) -> bytes | None:
    """The data of an entry; `None` where it is not what was put under this name."""
    data = entry[_DIGEST:]
    return data if entry.startswith(_seal(name, data)) else None


def _seal(name: str, data: bytes) -> bytes:
    digest = hashlib.sha256(name.encode() + b"\0")
    digest.update(data)
    return digest.digest()


class Store:
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
        """Whether everything is to be made again: nothing is loaded, and what is made is kept."""
        self._lock = threading.Lock()
        self._told: set[str] = set()
        self._waiting: list[str] = []
        self._tell: Callable[[str], None] = self._waiting.append
        self._written = 0
        self._tidied: set[Path] = set()

    def listen(self, tell: Callable[[str], None]) -> None:
        """Be told what is wrong with the store, a line each; also what was found before."""
        with self._lock:
            self._tell = tell
            waiting, self._waiting = self._waiting, []
        for line in waiting:
            tell(line)
        if self.shared is not None:
            self.shared.listen(self.say)

    def kept(self, kind: str, key: str, make: Callable[[], bytes], *, local: bool = False) -> bytes:
        """The result of this kind and key: from the store, or made now and kept."""
        found = self.load(kind, key)
        if found is not None:
            return found
        made = make()
        if self.fresh:
            before = self._load_here(f"{kind}/{key}")
            if before is not None and before != made:
                self.say(f"{_short(f'{kind}/{key}')} was made again and is not what was kept")
        self.keep(kind, key, made, local=local)
        return made

    def load(self, kind: str, key: str) -> bytes | None:
        """The result of this kind and key, if it is kept and whole."""
        if self.fresh:
            return None
        name = f"{kind}/{key}"
        found = self._load_here(name)
        if found is None and self.shared is not None:
            found = self._load_shared(name)
        return found

    def peek(self, kind: str, key: str) -> bytes | None:
        """What this machine keeps under a key, though everything is to be made again."""
        return self._load_here(f"{kind}/{key}")

    def keep(self, kind: str, key: str, data: bytes, *, local: bool = False) -> None:
        """Put a result into the store; one that cannot be written only costs time.

        A `local` one says something of this machine, or is made faster than fetched: it is not
        shared.
        """
        name = f"{kind}/{key}"
        entry = sealed(name, data)
        self._write_here(name, entry)
        if self.shared is not None and not local:
            self.shared.write(name, entry)

    def group(self, kind: str, key: str, *, newest: int = 8) -> list[str]:
        """The keys, `GROUP/KEY`, that are kept in a group, newest first, then the shared ones."""
        found: list[tuple[float, str]] = []
        folder = f"{self.folder}/{kind}/{key}"
        try:
            there = [name for name in os.listdir(folder) if name[0] != "."]  # noqa: PTH208
        except OSError:
            return []
        for name in there:
            with contextlib.suppress(OSError):
                # Of most groups there is one result: which is the newest need not be asked.
                when = os.stat(f"{folder}/{name}").st_mtime if len(there) > 1 else 0.0  # noqa: PTH116
                found.append((when, name))
        found.sort(reverse=True)
        for _, name in found[newest:]:
            with contextlib.suppress(OSError):
                (self.folder / kind / key / name).unlink()
        return [f"{key}/{name}" for _, name in found[:newest]]

    def shared_group(self, kind: str, key: str) -> list[str]:
        """The keys of a group that the shared cache has."""
        if self.shared is None or self.fresh:
            return []
        names = self.shared.names(f"{kind}/{key}")
        return [f"{key}/{name}" for name in names if HASH.fullmatch(name)]

    def close(self) -> None:
        """Wait until the shared cache has what was made, and keep the store within its limit."""
        if self.shared is not None:
            self.shared.flush()
        if self._written:
            prune_if_due(self.folder, self.size, self._written)
            self._written = 0

    def say(self, line: str) -> None:
        """Tell of something once."""
        with self._lock:
            if line in self._told:
                return
            self._told.add(line)
            tell = self._tell
        tell(line)

    # --- here

    def _load_here(self, name: str) -> bytes | None:
        path = f"{self.folder}/{name}"
        try:
            entry, changed = _read(path)
        except OSError:
            return None
        data = unsealed(name, entry)
        if data is None:
            with contextlib.suppress(OSError):
                os.unlink(path)  # noqa: PTH108
            self.say(f"{_short(name)} in {FOLDER} is damaged: it is made again")
            return None
        _note_use(path, changed)
        return data

    def _write_here(self, name: str, entry: bytes) -> None:
        path = self.folder / name
        try:
            try:
                _write(path, entry)
            except FileNotFoundError:
                make_private_folder(self.folder)
                path.parent.mkdir(parents=True, exist_ok=True)
                _write(path, entry)
            self._tidy(path.parent)
        except OSError as error:
            self.say(f"results cannot be kept in {FOLDER}: {reason(error)}")
            return
        with self._lock:
            self._written += len(entry)

    def _tidy(self, folder: Path) -> None:
        """Where something is written for the first time, what killed writers left goes."""
        with self._lock:
            if folder in self._tidied:
                return
            self._tidied.add(folder)
        remove_abandoned(folder)

    # --- shared

    def _load_shared(self, name: str) -> bytes | None:
        assert self.shared is not None
        entry = self.shared.read(name)
        if entry is None:
            return None
        data = unsealed(name, entry)
        if data is None:
            self.say(f"{_short(name)} in the shared cache is damaged: it is made again")
            return None
        self._write_here(name, entry)
        return data


def _write(path: Path, data: bytes) -> None:
    """Whole or not at all: readers in other processes see the old entry or the new one."""
    temporary = path.with_name(f"{TEMPORARY}{os.urandom(8).hex()}")
    fd = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    try:
        with os.fdopen(fd, "wb") as file:
            try_lock(fd)  # by which others see that its writer lives
            file.write(data)
            file.flush()
            Path(temporary).replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(temporary).unlink()
        raise


def _read(path: str) -> tuple[bytes, float]:
    """A file's bytes, and when it was changed; there are many, and most are small."""
    fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        status = os.fstat(fd)
        data = os.read(fd, status.st_size + 1)
        while len(data) != status.st_size and (more := os.read(fd, 1 << 20)):
            data += more
    finally:
        os.close(fd)
    return data, status.st_mtime


def _note_use(path: str, changed: float) -> None:
    """What was used lately stays; its time of change says when that was."""
    if time.time() - changed > _USED:
        with contextlib.suppress(OSError):
            os.utime(path)


def _short(name: str) -> str:
    """An entry as people are told of it."""
    kind, _, key = name.partition("/")
    return f"the entry {kind}/{key[:12]}…" if len(key) > 12 else f"the entry {name}"


# --- for a folder alone


def kept(root: Path, kind: str, key: str, make: Callable[[], bytes]) -> bytes:
    """See `Store.kept`."""
    return Store(root).kept(kind, key, make)


def load(root: Path, kind: str, key: str) -> bytes | None:
    """See `Store.load`."""
    return Store(root).load(kind, key)


def keep(root: Path, kind: str, key: str, data: bytes) -> None:
    """See `Store.keep`."""
    Store(root).keep(kind, key, data)
