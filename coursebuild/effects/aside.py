"""Bytes put aside in a file without a name, so that what is rarely looked at takes no memory.

Entry point: `Aside`, whose `put` gives a `Kept`; calling that gives the bytes back.

1. The file has no name: nothing is left of it, however this process ends.
2. What was looked at last is remembered, because it is often looked at again at once.
3. Where there is no room on the disk, or nothing may be written, the bytes stay in memory.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections import OrderedDict
from pathlib import Path

from coursebuild.effects.locks import make_private_folder
from coursebuild.values import dataclass, field

_LAST = 4
"""Texts that are remembered."""


class AsideError(Exception):
    """What was put aside belongs to another process."""


class Aside:
    """See the module. Safe to use from several threads, but only in the process that made it."""

    def __init__(self, folder: Path) -> None:
        """The file lies in `folder`, or in the system's where that is impossible."""
        self._folder = folder
        self._file: int | None = None
        self._size = 0
        self._lock = threading.Lock()
        self._process = os.getpid()
        self._texts: OrderedDict[tuple[int, int], str] = OrderedDict()

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
            if self._written(data):
                self._size += len(data)
                return Kept(self, start, len(data))
        return Kept(self, -1, len(data), data)

    def _written(self, data: bytes) -> bool:
        if not self.here:
            return False
        try:
            if self._file is None:
                self._file = _nameless(self._folder)
            rest, at = memoryview(data), self._size
            while rest:
                done = os.pwrite(self._file, rest, at)
                rest, at = rest[done:], at + done
        except OSError:
            return False
        return True

    def _read(self, start: int, size: int) -> bytes:
        if self._file is None or not self.here:
            raise AsideError("what was put aside cannot be read by a copy of the process")
        data = os.pread(self._file, size, start)
        while len(data) < size:
            part = os.pread(self._file, size - len(data), start + len(data))
            if not part:
                raise AsideError("what was put aside was cut")
            data += part
        return data

    def _text(self, kept: Kept) -> str:
        with self._lock:
            place = kept.start, kept.size  # what is empty begins where the next one does
            found = self._texts.pop(place, None)
            if found is None:
                found = self._read(kept.start, kept.size).decode("utf-8", "surrogatepass")
            self._texts[place] = found
            if len(self._texts) > _LAST:
                self._texts.popitem(last=False)
            return found


@dataclass(frozen=True, eq=False, slots=True)
class Kept:
    """Bytes that were put aside."""

    aside: Aside = field(repr=False)
    start: int
    size: int
    """Bytes."""
    data: bytes | None = field(default=None, repr=False)
    """The bytes themselves, where they had to stay in memory."""

    def __call__(self) -> bytes:
        """The bytes."""
        return self.aside._read(self.start, self.size) if self.data is None else self.data

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
