"""Many small entries of the store in few files: to make a file takes longer than to fill it.

Entry point: `Packs`, whose `put` takes an entry and whose `get` gives it back.

1. A process writes what it keeps into a file of its own, a pack, one entry behind the other
   (`pack_files`). One that has become large is closed, and the next one is begun.
2. What was written is never changed. Of two entries of one name that in the later pack counts.
3. What other processes keep meanwhile is found: when a name is not known, it is looked whether
   there are more packs, or whether those that are still written have grown.
4. When a command ends, packs whose writers are gone are closed, and small ones of which there are
   many are put together into one.

Entries are sealed by the store, which finds what is damaged. A pack is removed like any entry when
the store has grown too large: when it was not used for longest.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
import time
from pathlib import Path

from coursebuild.effects.locks import make_private_folder, try_lock
from coursebuild.effects.pack_files import (
    LONG,
    Pack,
    append,
    close,
    finish_left,
    grown,
    is_left,
    made,
    open_pack,
    read,
)
from coursebuild.effects.prune import HASH

FOLDER = "packs"
"""In the store's folder."""
_LARGE, _SMALL = 8 << 20, 64 << 10
"""Bytes after which a pack is closed, at most and at least."""
_SHARE = 32
"""Part of the store that a pack may take, which is removed as a whole."""
_MANY = 16
"""Packs of about one size that are put together."""
_USED = 3600.0
"""Seconds after which the use of a pack is noted again."""
_SETTLED = 100_000_000
"""ns for which a folder must not have changed to be known by its time of change."""
Place = tuple[Pack, int, int]
"""A pack, where an entry begins, its bytes."""


class Packs:
    """The packs of a store. Safe to use from several threads and copies of the process."""

    def __init__(self, folder: Path, limit: int = 1 << 30) -> None:
        """`folder` is the store's, which may take `limit` bytes."""
        self._store = folder
        self._large = max(_SMALL, min(_LARGE, limit // _SHARE))
        self._folder = f"{folder}/{FOLDER}"
        self._packs: dict[str, Pack] = {}
        """By name, which begin with the time, so that they sort by it."""
        self._order: tuple[Pack, ...] = ()
        """The latest first."""
        self._lost: set[bytes] = set()
        """Keys of entries that are damaged."""
        self._seen = (-1, 0)
        """The folder's time of change when it was listed, and when that was."""
        self._lock = threading.RLock()
        self._process = self._home = os.getpid()
        self._mine: Pack | None = None
        """The pack that this process writes."""
        self._fd = -1
        self._written = False

    def get(self, name: str) -> bytes | None:
        """The entry of a name, if there is one; it may be damaged."""
        key = _key(name)
        with self._lock:
            place = self._find(key)
            if place is None and self._look_again():
                place = self._find(key)
            if place is None:
                return None
            data = read(*place)
            if data is None:  # somebody has removed the pack
                self._seen = (-1, 0)
                if self._look_again() and (place := self._find(key)) is not None:
                    data = read(*place)
            if data is not None and place is not None:
                _note_use(place[0])
            return data

    def lose(self, name: str) -> None:
        """Have the entry of a name no more, since it is damaged."""
        with self._lock:
            self._lost.add(_key(name))

    def put(self, name: str, *entry: bytes) -> None:
        """Keep an entry, which may come in parts.

        Raises:
            OSError: it cannot be written.
        """
        key = _key(name)
        with self._lock:
            self._append(key, *entry)
            self._lost.discard(key)

    def close(self) -> None:
        """Close the pack that this process writes, and put small ones together."""
        with self._lock, contextlib.suppress(OSError):
            self._finish()
            if self._written:
                self._written = False
                self._look_again()
                for pack in self._order:  # those of copies of this process, and of killed ones
                    if not pack.is_closed:
                        with contextlib.suppress(OSError):  # it is gone, or somebody else's
                            finish_left(pack)
                self._put_together()

    # --- what there is

    def _find(self, key: bytes) -> Place | None:
        if key in self._lost:
            return None
        for pack in self._order:
            place = pack.find(key)
            if place is not None:
                return pack, *place
        return None

    def _look_again(self) -> bool:
        """Whether there is more than was known.

        What others keep meanwhile is of no use to a copy of the process.
        """
        if os.getpid() != self._home and self._seen != (-1, 0):
            return False
        try:
            changed = os.stat(self._folder).st_mtime_ns  # noqa: PTH116
        except OSError:
            if self._packs:
                self._listed()
            return False
        found = False
        if self._seen[0] != changed or self._seen[1] < changed + _SETTLED:
            self._seen = changed, time.time_ns()
            found = self._listed()
        for pack in self._order:
            if not pack.is_closed and pack is not self._mine:
                found |= grown(pack)
        return found

    def _listed(self) -> bool:
        """Find the packs that were not known, and forget those that are gone."""
        there: dict[str, Pack] = {}
        with contextlib.suppress(OSError), os.scandir(self._folder) as entries:
            for entry in entries:
                known = self._packs.get(entry.name)
                if known is not None:
                    there[entry.name] = known
                elif HASH.fullmatch(entry.name):
                    with contextlib.suppress(OSError):
                        pack = Pack(entry.path, entry.stat().st_mtime)
                        open_pack(pack)
                        there[entry.name] = pack
        is_new = not there.keys() <= self._packs.keys()
        self._take(there)
        if self._mine is not None and self._mine not in self._order:  # somebody has removed it
            if self._process == os.getpid():
                os.close(self._fd)
            self._mine, self._fd = None, -1
        return is_new

    def _take(self, packs: dict[str, Pack]) -> None:
        self._packs = packs
        self._order = tuple(packs[name] for name in sorted(packs, reverse=True))

    # --- what is kept

    def _append(self, key: bytes, *entry: bytes) -> None:
        pack = self._begun()
        append(self._fd, pack, key, *entry)
        self._written = True
        if pack.end >= self._large or pack.count >= LONG:
            self._finish()

    def _begun(self) -> Pack:
        """The pack that this process writes; open and locked as long as it lives."""
        if self._process != os.getpid():  # the file is that of the process that it is a copy of
            self._process, self._mine, self._fd = os.getpid(), None, -1
        while self._mine is None:
            name = f"{time.time_ns():016x}{os.urandom(24).hex()}"
            path = f"{self._folder}/{name}"
            try:
                self._fd = made(path)
            except FileNotFoundError:
                make_private_folder(self._store)
                Path(self._folder).mkdir(exist_ok=True)
                self._fd = made(path)
            if try_lock(self._fd) is False:  # by which others see that its writer lives
                os.close(self._fd)  # one of them took it for left before it was locked
                self._fd = -1
                continue
            self._mine = self._packs[name] = Pack(path, time.time())
            self._order = (self._mine, *self._order)
        return self._mine

    def _finish(self) -> None:
        """Write what is in the pack behind it, and leave it."""
        pack, fd = self._mine, self._fd
        self._mine, self._fd = None, -1
        if pack is None or self._process != os.getpid():
            return
        close(fd, pack)

    def _put_together(self) -> None:
        """Make one of many packs of about the same size."""
        sizes: dict[int, list[Pack]] = {}
        for pack in self._order:
            if pack.end < self._large // 2 and (pack.is_closed or is_left(pack)):
                sizes.setdefault(pack.end.bit_length() // 4, []).append(pack)
        for packs in sizes.values():
            if len(packs) >= _MANY:
                fd = os.open(self._folder, os.O_RDONLY | os.O_CLOEXEC)
                try:
                    if try_lock(fd) is not False:  # by another that does this now
                        self._move(packs)
                finally:
                    os.close(fd)

    def _move(self, packs: list[Pack]) -> None:
        for pack in packs:
            for key, start, size in pack:
                place = self._find(key)  # it may be in a later pack, or have been moved from one
                if place is not None and place[:2] == (pack, start):
                    entry = read(pack, start, size)
                    if entry is not None:
                        self._append(key, entry)
        self._finish()
        self._written = False
        for pack in packs:
            with contextlib.suppress(OSError):
                os.unlink(pack.path)  # noqa: PTH108
        self._take({name: pack for name, pack in self._packs.items() if pack not in packs})


def _key(name: str) -> bytes:
    return hashlib.sha256(name.encode()).digest()[:16]


def _note_use(pack: Pack) -> None:
    """What was used lately stays; its time of change says when that was."""
    now = time.time()
    if now - pack.changed > _USED:
        pack.changed = now
        with contextlib.suppress(OSError):
            os.utime(pack.path)
