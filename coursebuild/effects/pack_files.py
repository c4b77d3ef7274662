"""The file format of packs: many entries of the store, one behind the other.

Entry points: `Pack`, what is known of one; `made`, `append` and `close`, which write it;
`open_pack`, `grown` and `read`, which read it.

1. Before each entry stands a head that says how long it is and whose it is.
2. A closed pack has the list of its entries at its end: it is read in one go. Of one that is still
   written, or whose writer was killed, the heads are walked through as far as they are whole.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import struct
import zlib
from bisect import bisect_left
from collections.abc import Iterator

from coursebuild.effects.locks import is_abandoned
from coursebuild.values import dataclass, field

_HEAD = struct.Struct("<4sI16sQ")
"""Mark, a check of the rest, whose the entry is, its bytes."""
_ROW = struct.Struct("<16sQQ")
"""Whose an entry is, where it begins, its bytes."""
_FOOT = struct.Struct("<4sQ32s")
"""At the end of a closed pack: mark, how many rows stand before it, a hash of these."""
_ENTRY_MARK, _FOOT_MARK = b"cbe1", b"cbf1"
LONG = 1024
"""Entries of which a pack has no more."""
_FEW = 64
"""Entries that are held in a dictionary; more are in rows, which take an eighth of the memory."""


@dataclass(eq=False, slots=True)
class Pack:
    """What is known of a pack."""

    path: str
    changed: float
    """When it was last written or used, s."""
    end: int = 0
    """Bytes that were looked at, and are whole."""
    size: int = -1
    """Bytes that it had then."""
    is_closed: bool = False
    places: dict[bytes, tuple[int, int]] = field(default_factory=dict)
    """Where entries begin, and their bytes: the latest ones."""
    rows: bytes = b""
    """The others, sorted."""

    @property
    def count(self) -> int:
        """Entries, about: one of a name that was written again counts twice."""
        return len(self.places) + len(self.rows) // _ROW.size

    def find(self, key: bytes) -> tuple[int, int] | None:
        """Where the entry of a key begins, and its bytes."""
        place = self.places.get(key)
        if place is None and self.rows:
            at = bisect_left(_Keys(self.rows), key) * _ROW.size
            if self.rows[at : at + len(key)] == key:
                _, start, size = _ROW.unpack_from(self.rows, at)
                return start, size
        return place

    def add(self, key: bytes, start: int, size: int) -> None:
        """Note an entry."""
        self.places[key] = start, size
        if len(self.places) > _FEW:
            self.rows, self.places = self.all(), {}

    def add_all(self, entries: dict[bytes, tuple[int, int]]) -> None:
        """Note entries, the latest of each key."""
        if len(self.places) + len(entries) <= _FEW:
            self.places |= entries
            return
        known = {key: (start, size) for key, start, size in self} | entries
        self.rows = b"".join(_ROW.pack(key, *known[key]) for key in sorted(known))
        self.places = {}

    def all(self) -> bytes:
        """The rows of all entries, sorted."""
        rows = bytearray(self.rows)
        for key, place in self.places.items():
            at = bisect_left(_Keys(rows), key) * _ROW.size
            end = at + _ROW.size if rows.startswith(key, at) else at
            rows[at:end] = _ROW.pack(key, *place)
        return bytes(rows)

    def __iter__(self) -> Iterator[tuple[bytes, int, int]]:
        """Key, start and bytes of all entries."""
        return _ROW.iter_unpack(self.all())


@dataclass(frozen=True, eq=False, slots=True)
class _Keys:
    """The keys of rows."""

    rows: bytes | bytearray

    def __len__(self) -> int:
        return len(self.rows) // _ROW.size

    def __getitem__(self, index: int) -> bytes | bytearray:
        at = index * _ROW.size
        return self.rows[at : at + 16]


def _check(key: bytes, size: int) -> int:
    return zlib.crc32(size.to_bytes(8, "little"), zlib.crc32(key))


def made(path: str) -> int:
    """A file descriptor of a new pack."""
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)


def append(fd: int, pack: Pack, key: bytes, *entry: bytes) -> None:
    """Write an entry behind the others, whole or not at all; it may come in parts."""
    size = sum(map(len, entry))
    head = _HEAD.pack(_ENTRY_MARK, _check(key, size), key, size)
    try:
        _write(fd, (head, *entry), pack.end)
    except BaseException:
        with contextlib.suppress(OSError):
            os.ftruncate(fd, pack.end)
        raise
    pack.add(key, pack.end + len(head), size)
    pack.end += len(head) + size


def close(fd: int, pack: Pack) -> None:
    """Write the list of the entries behind them."""
    rows = pack.all()
    foot = _FOOT.pack(_FOOT_MARK, len(rows) // _ROW.size, hashlib.sha256(rows).digest())
    try:
        _write(fd, (rows, foot), pack.end)
        pack.is_closed = True
        pack.end += len(rows) + len(foot)
    finally:
        os.close(fd)


def _write(fd: int, parts: tuple[bytes, ...], at: int) -> None:
    done = os.pwritev(fd, parts, at) if hasattr(os, "pwritev") else 0
    if done != sum(map(len, parts)):
        rest = memoryview(b"".join(parts))[done:]
        while rest:
            count = os.pwrite(fd, rest, at + done)
            rest, done = rest[count:], done + count


def read(pack: Pack, start: int, size: int) -> bytes | None:
    """An entry's bytes; `None` where they are not there any more."""
    try:
        fd = os.open(pack.path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        data = os.pread(fd, size, start)
        while len(data) < size and (more := os.pread(fd, size - len(data), start + len(data))):
            data += more
        return data
    except OSError:
        return None
    finally:
        os.close(fd)


def open_pack(pack: Pack) -> None:
    """Find what is in a pack: from its foot, or by walking through it."""
    fd = os.open(pack.path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        size = os.fstat(fd).st_size
        rows = _rows(fd, size)
        if rows is None:
            _walk(pack, fd, size)
            return
    finally:
        os.close(fd)
    pack.is_closed = True
    pack.end = size
    if len(rows) > _FEW * _ROW.size:
        pack.rows = rows
    else:
        pack.places = {key: (start, length) for key, start, length in _ROW.iter_unpack(rows)}


def _rows(fd: int, size: int) -> bytes | None:
    """The rows of a closed pack; `None` where it is not closed, or they are damaged."""
    if size < _FOOT.size:
        return None
    foot = os.pread(fd, _FOOT.size, size - _FOOT.size)
    if len(foot) < _FOOT.size:
        return None
    mark, count, digest = _FOOT.unpack(foot)
    start = size - _FOOT.size - count * _ROW.size
    if mark != _FOOT_MARK or start < 0:
        return None
    rows = os.pread(fd, count * _ROW.size, start)
    return rows if hashlib.sha256(rows).digest() == digest else None


def grown(pack: Pack) -> bool:
    """Whether there is more in a pack that is being written."""
    before = pack.end
    with contextlib.suppress(OSError):
        if os.stat(pack.path).st_size != pack.size:  # noqa: PTH116
            fd = os.open(pack.path, os.O_RDONLY | os.O_CLOEXEC)
            try:
                _walk(pack, fd, os.fstat(fd).st_size)
            finally:
                os.close(fd)
    return pack.end > before


def _walk(pack: Pack, fd: int, size: int) -> None:
    """Note the entries behind those that are known, as far as they are whole."""
    pack.size = size
    found: dict[bytes, tuple[int, int]] = {}
    while pack.end + _HEAD.size <= size:
        head = os.pread(fd, _HEAD.size, pack.end)
        if len(head) < _HEAD.size:
            break
        mark, check, key, length = _HEAD.unpack(head)
        start = pack.end + _HEAD.size
        if mark != _ENTRY_MARK or check != _check(key, length) or start + length > size:
            break
        found[key] = start, length
        pack.end = start + length
    pack.add_all(found)


def finish_left(pack: Pack) -> None:
    """Close a pack whose writer is no more, which needs not be walked through then.

    Whoever else does so at the same time writes the same.
    """
    fd = os.open(pack.path, os.O_RDWR | os.O_CLOEXEC)
    if not is_abandoned(fd):
        os.close(fd)
        return
    try:
        _walk(pack, fd, os.fstat(fd).st_size)
        os.ftruncate(fd, pack.end)
    except BaseException:
        os.close(fd)
        raise
    close(fd, pack)


def is_left(pack: Pack) -> bool:
    """Whether whoever wrote a pack that is not closed is no more."""
    try:
        fd = os.open(pack.path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        return is_abandoned(fd)
    finally:
        os.close(fd)
