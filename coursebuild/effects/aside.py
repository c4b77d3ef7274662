"""Bytes put aside in a file without a name, so that what is rarely looked at takes no memory.

Entry points: `Aside`, whose `put` gives a `Kept`; calling that gives the bytes back. `for_copies`,
by which copies of the process can read them too.

1. The file has no name: nothing is left of it, however this process ends.
2. What was looked at last is remembered, because it is often looked at again at once.
3. Small ones wait until there are some, and are written together.
4. Where there is no room on the disk, or nothing may be written, the bytes stay in memory.
"""

from __future__ import annotations

import contextlib
import os
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

from coursebuild.effects.locks import make_private_folder
from coursebuild.values import dataclass, field

_LAST = 4
"""Texts that are remembered."""
_AT_ONCE = 1 << 18
"""Bytes that wait to be written, about."""
_BITS = 40
_MOST = (1 << _BITS) - 1
"""Bytes that can be put aside at once."""


class AsideError(Exception):
    """What was put aside belongs to another process."""


class Aside:
    """See the module. Safe to use from several threads, but only in the process that made it.

    Copies of that process may read what was there when they were made: see `for_copies`.
    """

    def __init__(self, folder: Path) -> None:
        """The file lies in `folder`, or in the system's where that is impossible."""
        self._folder = folder
        self._file: int | None = None
        self._size = 0
        self._waiting: list[bytes] = []
        """What is not in the file yet."""
        self._done = 0
        """Bytes that are in the file."""
        self._rest: bytes | None = None
        """What follows them, where it could not be written; from then on nothing is."""
        self._lock = threading.RLock()
        self._process = self._open_in = os.getpid()
        self._texts: OrderedDict[int, str] = OrderedDict()
        _ASIDES.add(self)

    def __del__(self) -> None:
        """A copy of the process has closed the file already, and may have another by its number."""
        if self._file is not None and self.here:
            os.close(self._file)

    @property
    def here(self) -> bool:
        """Whether this is the process that made it."""
        return self._process == os.getpid()

    def put(self, data: bytes) -> Kept:
        """Put bytes aside."""
        with self._lock:
            start = self._size
            if len(data) <= _MOST and self._written(data):
                self._size += len(data)
                return Kept(self, start << _BITS | len(data))
        return Kept(self, -1 << _BITS | (len(data) & _MOST), data)

    def _written(self, data: bytes) -> bool:
        if self._rest is not None or not self.here:
            return False
        try:
            if self._file is None:
                self._file = _nameless(self._folder)
        except OSError:
            return False
        self._waiting.append(data)
        if self._size + len(data) - self._done >= _AT_ONCE:
            self._write()
        return True

    def _write(self) -> None:
        """Write what waits; what cannot be written stays."""
        data = b"".join(self._waiting)
        self._waiting.clear()
        try:
            assert self._file is not None
            rest, at = memoryview(data), self._done
            while rest:
                done = os.pwrite(self._file, rest, at)
                rest, at = rest[done:], at + done
        except OSError:
            self._rest = data
        else:
            self._done += len(data)

    def _read(self, start: int, size: int) -> bytes:
        if self._file is None or self._open_in != os.getpid():
            raise AsideError("what was put aside cannot be read by a copy of the process")
        if start + size > self._done:
            with self._lock:
                if self._waiting:
                    self._write()
            if self._rest is not None and start >= self._done:
                return self._rest[start - self._done :][:size]
        data = os.pread(self._file, size, start)
        while len(data) < size:
            part = os.pread(self._file, size - len(data), start + len(data))
            if not part:
                raise AsideError("what was put aside was cut")
            data += part
        return data

    def _text(self, kept: Kept) -> str:
        with self._lock:
            place = kept.place  # what is empty begins where the next one does
            found = self._texts.pop(place, None)
            if found is None:
                found = self._read(kept.start, kept.size).decode("utf-8", "surrogatepass")
            self._texts[place] = found
            if len(self._texts) > _LAST:
                self._texts.popitem(last=False)
            return found


_ASIDES: weakref.WeakSet[Aside] = weakref.WeakSet()
"""All of this process."""


def for_copies() -> tuple[tuple[int, ...], Callable[[], None]]:
    """What copies of this process need to read what was put aside until now.

    Returns:
        The file descriptors that must stay open in them, and what each calls first.
    """
    asides = [aside for aside in _ASIDES if aside._open_in == os.getpid()]
    for aside in asides:
        with aside._lock:
            if aside._waiting:
                aside._write()
    files = [aside._file for aside in asides if aside._file is not None]

    def begin() -> None:
        for aside in asides:
            aside._open_in = os.getpid()

    return tuple(files), begin


@dataclass(frozen=True, eq=False, slots=True)
class Kept:
    """Bytes that were put aside."""

    aside: Aside = field(repr=False)
    place: int
    """Where they begin and how many they are, in one number: a long course has many of them."""
    data: bytes | None = field(default=None, repr=False)
    """The bytes themselves, where they had to stay in memory."""

    @property
    def start(self) -> int:
        """Where they begin."""
        return self.place >> _BITS

    @property
    def size(self) -> int:
        """Bytes."""
        return self.place & _MOST

    def __call__(self) -> bytes:
        """The bytes."""
        return self.aside._read(self.start, self.size) if self.data is None else self.data

    def part(self, start: int, size: int) -> Kept:
        """Some of the bytes."""
        if self.data is not None:
            return Kept(self.aside, -1 << _BITS | size, self.data[start : start + size])
        return Kept(self.aside, (self.start + start) << _BITS | size)

    def text(self) -> str:
        """The text that they are in UTF-8."""
        if self.data is not None:
            return self.data.decode("utf-8", "surrogatepass")
        return self.aside._text(self)


def _nameless(folder: Path) -> int:
    """A file descriptor."""
    with contextlib.suppress(OSError):
        make_private_folder(folder)
        return _nameless_in(folder)
    import tempfile  # which takes a while to import

    return _nameless_in(Path(tempfile.gettempdir()))


def _nameless_in(folder: Path) -> int:
    flags = os.O_RDWR | os.O_CLOEXEC
    if hasattr(os, "O_TMPFILE"):
        with contextlib.suppress(OSError):  # a file system that has no such files
            return os.open(folder, flags | os.O_TMPFILE, 0o600)
    path = folder / f".aside-{os.urandom(8).hex()}"
    file = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o600)
    path.unlink()
    return file
